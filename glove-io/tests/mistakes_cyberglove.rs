//! Mistakes of other CyberGlove drivers that this one does not repeat.

use glove_io::cyberglove::{
    MAX_RECORD, PacketParser, Parser, Record, RecordFormat, Reply, parse_reply,
};
use glove_io::sim::CyberGlove;

fn ask(glove: &mut CyberGlove, bytes: &[u8]) -> Vec<u8> {
    let mut reply = Vec::new();
    glove.receive(bytes, &mut reply);
    reply
}

fn encode(record: &Record) -> Vec<u8> {
    let mut out = [0; MAX_RECORD];
    let len = record.encode(&mut out);
    out[..len].to_vec()
}

fn parse(format: RecordFormat, bytes: &[u8]) -> Vec<Record> {
    let mut records = Vec::new();
    Parser::new(format).push(bytes, |record| records.push(record));
    records
}

/// Splitting replies on NUL: a version 2.0 is not the end of the reply.
#[test]
fn replies_are_not_split_on_nul() {
    assert_eq!(
        parse_reply(b"?V\x02\0\x01\0\0"),
        Ok(Some((Reply::Version([2, 0, 1, 0]), 7)))
    );
}

/// Control codes written as two characters are unknown commands, and harmless.
#[test]
fn literal_control_codes_do_not_hang_the_glove() {
    let mut glove = CyberGlove::default();
    assert_eq!(ask(&mut glove, b"^R^c"), b"e?\0".repeat(4));
    assert_eq!(ask(&mut glove, b"?W"), b"?W\0\0");
}

/// Every flag of a time stamp flips bit 0 of its byte, not a bit of its own.
#[test]
fn time_stamp_flags_flip_bit_zero() {
    let mut bytes = vec![b'G'];
    bytes.extend([9; 22]);
    bytes.extend([0x8F, 1, 1, 1, 1, 0]);
    let format = RecordFormat {
        time_stamp: true,
        ..RecordFormat::default()
    };
    assert_eq!(parse(format, &bytes)[0].time_stamp, Some(0));
}

/// Two 8-bit records are not one 16-bit packet.
#[test]
fn an_8_bit_stream_is_not_read_as_16_bit() {
    let mut glove = CyberGlove::default();
    let mut bytes = ask(&mut glove, b"S");
    for _ in 0..20 {
        glove.tick(&mut bytes);
    }
    let mut packets = 0;
    PacketParser::new().push(&bytes, |_| packets += 1);
    assert_eq!(packets, 0);
    assert_eq!(parse(RecordFormat::default(), &bytes).len(), 20);
}

/// No command needs an end of line, and any end of line is ignored.
#[test]
fn commands_need_no_carriage_return() {
    for end in ["", "\r", "\n", "\r\n", "\0"] {
        let mut glove = CyberGlove::default();
        let command = format!("?S{end}?W{end}");
        assert_eq!(ask(&mut glove, command.as_bytes()), b"?S\x16\0?W\0\0");
    }
}

/// A sensor value that looks like a head is not the beginning of a record.
#[test]
fn sensor_values_that_look_like_heads_do_not_mislead() {
    for head in *b"GS" {
        let record = Record::try_new(&[head; 22]).unwrap();
        let bytes = encode(&record).repeat(2);
        for start in 1..24 {
            let records = parse(RecordFormat::default(), &bytes[start..]);
            assert_eq!(records, [record], "joined at byte {start}");
        }
    }
}

/// A zero among the sensor values costs one record and ends the wait.
#[test]
fn a_zero_sensor_byte_costs_one_record() {
    let record = Record::try_new(&[9; 22]).unwrap();
    let mut bytes = encode(&record).repeat(2);
    bytes[5] = 0;
    assert_eq!(parse(RecordFormat::default(), &bytes), [record]);
    // The firmware sends no zero to begin with.
    let mut glove = CyberGlove::default();
    glove.set_sensors([0; 22]);
    assert_eq!(ask(&mut glove, b"G")[1..23], [1; 22]);
}
