//! Laws of the CyberGlove's parsers and simulator, for arbitrary bytes.
//!
//! Each function derives everything from `data` and panics where a law is broken.

use glove_io::cyberglove::{
    MAX_RECORD, PACKET_LEN, PacketParser, Parser, RecordFormat, SensorCount, parse_reply,
};
use glove_io::sim::CyberGlove;

/// Records: pieces do not matter, every byte is accounted for, and a record
/// encodes to bytes that were pushed.
///
/// # Panics
///
/// If one of these laws is broken.
pub fn cyberglove_records(data: &[u8]) {
    let Some((&[choice, piece], bytes)) = data.split_first_chunk() else {
        return;
    };
    let format = RecordFormat {
        sensors: if choice & 1 == 0 {
            SensorCount::TwentyTwo
        } else {
            SensorCount::Eighteen
        },
        time_stamp: choice & 2 != 0,
        status: choice & 4 != 0,
    };
    let (mut whole, mut pieces, mut single) = (
        Parser::new(format),
        Parser::new(format),
        Parser::new(format),
    );
    let (mut a, mut b, mut c) = (Vec::new(), Vec::new(), Vec::new());
    whole.push(bytes, |record| a.push(record));
    for piece in bytes.chunks(usize::from(piece).max(1)) {
        pieces.push(piece, |record| b.push(record));
    }
    for byte in bytes.chunks(1) {
        single.push(byte, |record| c.push(record));
    }
    assert!(a == b && a == c, "records depend on the pieces");
    assert_eq!(whole.counters(), pieces.counters());
    assert_eq!(whole.counters(), single.counters());
    assert_eq!(whole.pending(), single.pending());
    assert!(whole.pending() < MAX_RECORD);

    let mut in_records = 0;
    for record in &a {
        assert_eq!(record.format(), format);
        let mut out = [0; MAX_RECORD];
        in_records += record.encode(&mut out);
    }
    account(
        &whole.counters(),
        a.len(),
        in_records,
        whole.pending(),
        bytes,
    );
}

/// Packets: pieces do not matter, every byte is accounted for, and a packet
/// encodes to bytes that were pushed.
///
/// # Panics
///
/// If one of these laws is broken.
pub fn cyberglove_packets(data: &[u8]) {
    let Some((&piece, bytes)) = data.split_first() else {
        return;
    };
    let (mut whole, mut pieces, mut single) = (
        PacketParser::new(),
        PacketParser::new(),
        PacketParser::new(),
    );
    let (mut a, mut b, mut c) = (Vec::new(), Vec::new(), Vec::new());
    whole.push(bytes, |packet| a.push(packet));
    for piece in bytes.chunks(usize::from(piece).max(1)) {
        pieces.push(piece, |packet| b.push(packet));
    }
    for byte in bytes.chunks(1) {
        single.push(byte, |packet| c.push(packet));
    }
    assert!(a == b && a == c, "packets depend on the pieces");
    assert_eq!(whole.counters(), pieces.counters());
    assert_eq!(whole.counters(), single.counters());
    assert_eq!(whole.pending(), single.pending());
    assert!(whole.pending() < PACKET_LEN);

    let mut rest = bytes;
    for packet in &a {
        let encoded = packet.encode();
        let place = rest
            .windows(PACKET_LEN)
            .position(|window| window == encoded);
        let place = place.expect("a packet was sent in one piece, after the one before it");
        rest = &rest[place + PACKET_LEN..];
    }
    let in_packets = PACKET_LEN * a.len();
    account(
        &whole.counters(),
        a.len(),
        in_packets,
        whole.pending(),
        bytes,
    );
}

/// Replies: what follows a reply does not change it, and what is short of one is
/// incomplete.
///
/// # Panics
///
/// If one of these laws is broken.
pub fn cyberglove_replies(data: &[u8]) {
    let Ok(Some((reply, len))) = parse_reply(data) else {
        return;
    };
    assert!(len <= data.len());
    assert_eq!(data[len - 1], 0);
    assert_eq!(parse_reply(&data[..len]), Ok(Some((reply, len))));
    for cut in 0..len {
        assert_eq!(parse_reply(&data[..cut]), Ok(None));
    }
}

/// The simulator: pieces do not matter, and the answer is bounded.
///
/// # Panics
///
/// If one of these laws is broken.
pub fn cyberglove_simulator(data: &[u8]) {
    let Some((&piece, bytes)) = data.split_first() else {
        return;
    };
    let (mut whole, mut pieces) = (CyberGlove::default(), CyberGlove::default());
    let (mut a, mut b) = (Vec::new(), Vec::new());
    whole.receive(bytes, &mut a);
    for piece in bytes.chunks(usize::from(piece).max(1)) {
        pieces.receive(piece, &mut b);
    }
    whole.tick(&mut a);
    pieces.tick(&mut b);
    assert_eq!(a, b, "answers depend on the pieces");
    assert!(a.len() <= MAX_RECORD * (bytes.len() + 1));
}

fn account(
    counters: &glove_io::Counters,
    records: usize,
    in_records: usize,
    pending: usize,
    bytes: &[u8],
) {
    assert_eq!(counters.records, records as u64);
    assert_eq!(
        in_records as u64 + counters.dropped_bytes + pending as u64,
        bytes.len() as u64
    );
    assert!(counters.resyncs <= counters.records + 1);
}
