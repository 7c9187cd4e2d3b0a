//! Laws of the CyberGlove's parsers and simulator, for arbitrary bytes.
//!
//! Each function derives everything from its bytes and panics where a law is broken.

use glove_io::Counters;
use glove_io::cyberglove::{
    MAX_RECORD, PACKET_LEN, Packet, PacketParser, Parser, Record, RecordFormat, SensorCount,
    Status, TimeCode, parse_reply,
};
use glove_io::sim::CyberGlove;
use proptest::prelude::*;

/// What a parser found in all bytes: frames, counters and bytes still pending.
type Found<F> = (Vec<F>, Counters, usize);

/// What `parse` finds in the bytes at once, which it must find in pieces too.
fn in_any_pieces<'a, F: PartialEq + std::fmt::Debug>(
    bytes: &'a [u8],
    piece: u8,
    parse: impl Fn(&mut dyn Iterator<Item = &'a [u8]>) -> Found<F>,
) -> Found<F> {
    let whole = parse(&mut [bytes].into_iter());
    assert_eq!(parse(&mut bytes.chunks(usize::from(piece).max(1))), whole);
    assert_eq!(parse(&mut bytes.chunks(1)), whole);
    whole
}

/// Every byte is in a frame, dropped or pending.
fn account<F>((frames, counters, pending): &Found<F>, in_frames: usize, bytes: &[u8]) {
    assert_eq!(counters.records, frames.len() as u64);
    assert_eq!(
        (in_frames + pending) as u64 + counters.dropped_bytes,
        bytes.len() as u64
    );
    assert!(counters.resyncs <= counters.records + 1);
}

/// What follows `part` in `bytes`, which must hold it in one piece.
fn after<'a>(bytes: &'a [u8], part: &[u8]) -> &'a [u8] {
    let place = bytes.windows(part.len()).position(|window| window == part);
    &bytes[place.expect("a frame was sent in one piece, after the one before it") + part.len()..]
}

/// Records: pieces do not matter, every byte is accounted for, and a record's head
/// and sensor values were sent together. (Time stamp and status may be written in
/// more than one way, so they need not encode to the same bytes.)
fn check_records(data: &[u8]) {
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
    let found = in_any_pieces(bytes, piece, |pieces| {
        let (mut parser, mut records) = (Parser::new(format), Vec::new());
        pieces.for_each(|piece| parser.push(piece, |record| records.push(record)));
        (records, parser.counters(), parser.pending())
    });
    assert!(found.2 < MAX_RECORD);

    let (mut in_records, mut rest) = (0, bytes);
    for record in &found.0 {
        assert_eq!(record.format(), format);
        let mut out = [0; MAX_RECORD];
        in_records += record.encode(&mut out);
        rest = after(rest, &out[..=format.sensors.get()]);
    }
    account(&found, in_records, bytes);
}

/// Packets: pieces do not matter, every byte is accounted for, and a packet
/// encodes to bytes that were sent together.
fn check_packets(data: &[u8]) {
    let Some((&piece, bytes)) = data.split_first() else {
        return;
    };
    let found = in_any_pieces(bytes, piece, |pieces| {
        let (mut parser, mut packets) = (PacketParser::new(), Vec::new());
        pieces.for_each(|piece| parser.push(piece, |packet| packets.push(packet)));
        (packets, parser.counters(), parser.pending())
    });
    assert!(found.2 < PACKET_LEN);

    let mut rest = bytes;
    for packet in &found.0 {
        rest = after(rest, &packet.encode());
    }
    account(&found, PACKET_LEN * found.0.len(), bytes);
}

/// Replies: what follows a reply does not change it, and what is short of one is
/// incomplete.
fn check_replies(data: &[u8]) {
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
fn check_simulator(data: &[u8]) {
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

/// Pieces of noise, good records and good packets, which may be cut short.
fn stream() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop::collection::vec(any::<u8>(), 0..12);
    let text = prop::collection::vec(prop::sample::select(b"GS?es\0\x03U1:0DNM".to_vec()), 0..12);
    let record = (
        prop_oneof![Just(18_usize), Just(22)],
        prop::collection::vec(1..=u8::MAX, 22),
        prop::option::of(any::<u32>()),
        prop::option::of(Just(Status::default())),
    )
        .prop_map(|(count, values, stamp, status)| {
            let mut record = Record::try_new(&values[..count]).expect("values from 1 up");
            record.time_stamp = stamp;
            record.status = status;
            let mut out = [0; MAX_RECORD];
            let len = record.encode(&mut out);
            out[..len].to_vec()
        });
    let packet = prop::array::uniform22(0..4096_u16).prop_map(|values| {
        let packet = Packet::try_new(TimeCode::default(), values).expect("12 bits");
        packet.encode().to_vec()
    });
    let piece = prop_oneof![noise, text, record, packet];
    let cut =
        (piece, any::<prop::sample::Index>(), any::<bool>()).prop_map(|(mut bytes, at, cut)| {
            if cut {
                bytes.truncate(at.index(bytes.len() + 1));
            }
            bytes
        });
    (any::<[u8; 2]>(), prop::collection::vec(cut, 0..12)).prop_map(|(choice, pieces)| {
        let mut bytes = choice.to_vec();
        bytes.extend(pieces.into_iter().flatten());
        bytes
    })
}

proptest! {
    /// All of the above, on whole, shortened and made-up frames.
    #[test]
    fn all_checks_hold(data in stream()) {
        check_records(&data);
        check_packets(&data);
        check_replies(&data);
        check_replies(data.get(2..).unwrap_or_default());
        check_simulator(&data);
    }
}
