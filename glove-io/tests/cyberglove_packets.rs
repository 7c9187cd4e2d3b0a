//! Laws of the 16-bit packets of the CyberGlove III.

use glove_io::cyberglove::{PACKET_LEN, Packet, PacketError, PacketParser, TimeCode};
use proptest::prelude::*;

fn packet() -> impl Strategy<Value = Packet> {
    (
        (0..24_u8, 0..60_u8, 0..60_u8, 0..30_u8, 0..10_u8),
        prop::array::uniform22(0..4096_u16),
        any::<[u8; 3]>(),
    )
        .prop_map(
            |((hours, minutes, seconds, frame, subframe), values, trailer)| {
                let time = TimeCode {
                    hours,
                    minutes,
                    seconds,
                    frame,
                    subframe,
                };
                let mut packet = Packet::try_new(time, values).expect("all in range");
                packet.trailer = trailer;
                packet
            },
        )
}

fn encode(packets: &[Packet]) -> Vec<u8> {
    packets.iter().flat_map(Packet::encode).collect()
}

fn parse(bytes: &[u8]) -> (Vec<Packet>, PacketParser) {
    let mut parser = PacketParser::new();
    let mut packets = Vec::new();
    parser.push(bytes, |packet| packets.push(packet));
    (packets, parser)
}

proptest! {
    /// Parsing what was encoded gives the same packets and drops the echo only.
    #[test]
    fn parsing_inverts_encoding(packets in prop::collection::vec(packet(), 1..6)) {
        let mut bytes = b"1S".to_vec();
        bytes.extend(encode(&packets));
        let (parsed, parser) = parse(&bytes);
        prop_assert_eq!(&parsed, &packets);
        prop_assert_eq!((parser.counters().dropped_bytes, parser.pending()), (2, 0));
    }

    /// A changed byte costs or alters its own packet, no other.
    #[test]
    fn a_changed_byte_harms_one_packet(
        packets in prop::collection::vec(packet(), 3),
        place in 0..PACKET_LEN,
        byte in any::<u8>(),
    ) {
        let mut bytes = encode(&packets);
        bytes[PACKET_LEN + place] = byte;
        let (parsed, _) = parse(&bytes);
        prop_assert_eq!(parsed.first(), Some(&packets[0]));
        prop_assert_eq!(parsed.last(), Some(&packets[2]));
        prop_assert!(parsed.len() <= 3);
    }

    /// A byte missing from time code or values costs its packet only. Low bytes of
    /// 16 and more make a shift by one byte visible in the upper bits.
    #[test]
    fn a_missing_byte_costs_one_packet(
        values in prop::array::uniform22((0..16_u16, 16..256_u16)),
        place in 0..PACKET_LEN - 5,
    ) {
        let values = values.map(|(high, low)| 256 * high + low);
        let packets = [1, 2, 3].map(|seconds| {
            let time = TimeCode { seconds, ..TimeCode::default() };
            Packet::try_new(time, values).expect("12 bits")
        });
        let mut bytes = encode(&packets);
        bytes.remove(PACKET_LEN + place);
        prop_assert_eq!(parse(&bytes).0, [packets[0], packets[2]]);
    }

    /// An inserted byte costs or alters one packet. Low bytes as above.
    #[test]
    fn an_inserted_byte_harms_one_packet(
        values in prop::array::uniform22((0..16_u16, 16..256_u16)),
        place in 0..=PACKET_LEN,
        byte in any::<u8>(),
    ) {
        let values = values.map(|(high, low)| 256 * high + low);
        let packets = [1, 2, 3].map(|seconds| {
            let time = TimeCode { seconds, ..TimeCode::default() };
            Packet::try_new(time, values).expect("12 bits")
        });
        let mut bytes = encode(&packets);
        bytes.insert(PACKET_LEN + place, byte);
        let (parsed, _) = parse(&bytes);
        prop_assert_eq!(parsed.first(), Some(&packets[0]));
        prop_assert_eq!(parsed.last(), Some(&packets[2]));
        prop_assert!(parsed.len() <= 3);
    }
}

#[test]
fn documented_packet() {
    let time = TimeCode {
        hours: 12,
        minutes: 34,
        seconds: 56,
        frame: 29,
        subframe: 2,
    };
    let mut bytes = b"12:34:56:29:2S".to_vec();
    bytes.extend([0x08, 0x00].repeat(22));
    bytes.extend([1, 2, 3]);
    assert_eq!(bytes.len(), 61);
    let (packets, _) = parse(&bytes);
    assert_eq!(packets[0].time(), time);
    assert_eq!(packets[0].eight_bit_values(), [128; 22]);
    assert_eq!(packets[0].trailer, [1, 2, 3]);
}

#[test]
fn impossible_packets_are_refused() {
    let late = TimeCode {
        hours: 24,
        ..TimeCode::default()
    };
    assert_eq!(
        Packet::try_new(late, [0; 22]),
        Err(PacketError::TimeCode { time: late })
    );
    let mut values = [0; 22];
    values[7] = 4096;
    assert_eq!(
        Packet::try_new(TimeCode::default(), values),
        Err(PacketError::Value {
            index: 7,
            value: 4096
        })
    );
    let mut bytes = encode(&[Packet::try_new(TimeCode::default(), [0; 22]).unwrap()]);
    bytes[..2].copy_from_slice(b"24");
    assert!(parse(&bytes).0.is_empty());
}
