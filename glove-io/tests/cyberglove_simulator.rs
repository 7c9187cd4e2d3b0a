//! The simulated CyberGlove, spoken to as real clients do.

use std::time::Duration;

use glove_io::cyberglove::{
    Parser, Query, Record, RecordFormat, Reply, SamplePeriod, SensorCount, Setting, SettingLetter,
    WordOrder, parse_reply,
};
use glove_io::sim::CyberGlove;
use proptest::prelude::*;

fn ask_glove(glove: &mut CyberGlove, bytes: &[u8]) -> Vec<u8> {
    let mut reply = Vec::new();
    glove.receive(bytes, &mut reply);
    reply
}

fn parse_records(format: RecordFormat, bytes: &[u8]) -> Vec<Record> {
    let mut records = Vec::new();
    Parser::new(format).push(bytes, |record| records.push(record));
    records
}

/// The start-up of the ROS driver of asr-ros: same mask, same count, then poll.
#[test]
fn glove_answers_a_ros_driver() {
    let mut glove = CyberGlove::new(SensorCount::Eighteen);
    assert_eq!(ask_glove(&mut glove, b"?K"), b"?K\x3F\xBB\x7B\0");
    assert_eq!(ask_glove(&mut glove, b"M\x3F\xBB\x7B"), b"M\0");
    assert_eq!(ask_glove(&mut glove, b"?S"), b"?S\x12\0");
    assert_eq!(ask_glove(&mut glove, b"N\x12"), b"N\0");
    assert_eq!(ask_glove(&mut glove, b"?U"), b"?U\0\0");
    assert_eq!(ask_glove(&mut glove, b"?D"), b"?D\0\0");
    let record = ask_glove(&mut glove, b"G");
    assert_eq!(record.len(), 20);
    assert_eq!((record[0], record[19]), (b'G', 0));
    // The driver writes control codes as two characters.
    assert_eq!(ask_glove(&mut glove, b"^R"), b"e?\0e?\0");
}

/// The start-up of the VESS library, and payloads that contain zeros.
#[test]
fn glove_answers_all_queries_with_the_promised_length() {
    let mut glove = CyberGlove::default();
    assert_eq!(ask_glove(&mut glove, b"?G"), b"?G\x03\0");
    glove.set_plugged_in(false);
    assert_eq!(ask_glove(&mut glove, b"?G"), b"?G\x01\0");
    glove.set_right_hand(false);
    assert_eq!(ask_glove(&mut glove, b"?R"), b"?R\0\0");
    for query in Query::ALL {
        let reply = ask_glove(&mut glove, &query.command());
        assert!(
            matches!(parse_reply(&reply), Ok(Some((_, len))) if len == reply.len()),
            "{query:?}"
        );
    }
    assert_eq!(ask_glove(&mut glove, b"\r\n\0"), b"");
    assert_eq!(ask_glove(&mut glove, b"?z"), b"e?\0");
    assert_eq!(ask_glove(&mut glove, b"N\x17"), b"en\0");
    assert_eq!(ask_glove(&mut glove, b"U\x02"), b"en\0");
}

#[test]
fn glove_streams_what_was_set() {
    let mut glove = CyberGlove::default();
    let mut sensors = [0; 22];
    for (value, sensor) in (0..).zip(&mut sensors) {
        *sensor = value;
    }
    glove.set_sensors(sensors);
    glove.set_wrist_switch(true);
    assert_eq!(ask_glove(&mut glove, b"D\x01U\x01?W"), b"D\0U\0?W\x01\0");

    let mut bytes = ask_glove(&mut glove, b"S");
    for _ in 0..300 {
        glove.tick(&mut bytes);
    }
    let format = RecordFormat {
        time_stamp: true,
        status: true,
        ..RecordFormat::default()
    };
    let records = parse_records(format, &bytes);
    let stamps: Vec<_> = records.iter().map(|r| r.time_stamp.unwrap()).collect();
    assert_eq!(stamps, (1..=300).collect::<Vec<_>>());
    sensors[0] = 1; // the firmware sends no zero
    assert!(records.iter().all(|r| r.sensors() == sensors && r.streamed));
    assert!(records[0].status.unwrap().wrist_switch);

    assert_eq!(ask_glove(&mut glove, b"\x03"), b"\x03\0");
    let mut silence = Vec::new();
    glove.tick(&mut silence);
    assert!(silence.is_empty());

    glove.set_plugged_in(false);
    let unplugged = ask_glove(&mut glove, b"G");
    assert!(parse_records(format, &unplugged)[0].glove_missing);
}

#[test]
fn mask_and_count_shorten_records() {
    let mut glove = CyberGlove::default();
    let mut sensors = [9; 22];
    (sensors[0], sensors[1], sensors[4]) = (10, 11, 14);
    glove.set_sensors(sensors);
    // Slots 0, 1 and 4.
    assert_eq!(ask_glove(&mut glove, b"M\x13\0\0?M"), b"M\0?M\x13\0\0\0");
    assert_eq!(ask_glove(&mut glove, b"G"), b"G\x0A\x0B\x0E\0");
    assert_eq!(ask_glove(&mut glove, b"N\x02G"), b"N\0G\x0A\x0B\0");
}

#[test]
fn acknowledgements_are_replies() {
    let mut glove = CyberGlove::default();
    let reply = ask_glove(&mut glove, b"D\x01");
    assert_eq!(
        parse_reply(&reply),
        Ok(Some((Reply::Accepted(SettingLetter::TimeStamp), 2)))
    );
}

#[test]
fn the_sample_period_is_what_was_set() {
    let mut glove = CyberGlove::default();
    assert_eq!(glove.sample_period(), Duration::from_millis(10));
    let mut command = [0; 5];
    let period = SamplePeriod([1440, 1]);
    let len = Setting::SamplePeriod(period, WordOrder::LowFirst).encode(&mut command);
    assert_eq!(ask_glove(&mut glove, &command[..len]), b"T\0");
    assert_eq!(ask_glove(&mut glove, b"?T"), b"?T\xA0\x05\x01\0\0");
    assert_eq!(ask_glove(&mut glove, b"T\0\0\x01\0"), b"en\0");
    assert_eq!(glove.sample_period(), Duration::from_micros(12_500));
}

/// Bytes that mean something to the glove, and others.
fn command_bytes() -> impl Strategy<Value = Vec<u8>> {
    let known = b"GS?GSNKMRUDWTV\x03UDNMT\0\x01\r\n".to_vec();
    prop::collection::vec(
        prop_oneof![any::<u8>(), prop::sample::select(known)],
        0..200,
    )
}

proptest! {
    /// Commands may arrive in pieces of any size; no bytes panic.
    #[test]
    fn splitting_commands_changes_no_reply(bytes in command_bytes(), cut in any::<prop::sample::Index>()) {
        let (head, tail) = bytes.split_at(cut.index(bytes.len() + 1));
        let (mut whole, mut pieces) = (CyberGlove::default(), CyberGlove::default());
        let mut reply = ask_glove(&mut pieces, head);
        pieces.receive(tail, &mut reply);
        prop_assert_eq!(ask_glove(&mut whole, &bytes), reply);
    }
}
