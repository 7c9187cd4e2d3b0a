//! The laws the fuzz targets check, on bytes that proptest generates.

use glove_io::cyberglove::{MAX_RECORD, Packet, Record, Status, TimeCode};
use proptest::prelude::*;

#[path = "../fuzz/checks/cyberglove.rs"]
pub mod checks;

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
    #[test]
    fn all_checks_hold(data in stream()) {
        checks::cyberglove_records(&data);
        checks::cyberglove_packets(&data);
        checks::cyberglove_replies(&data);
        checks::cyberglove_replies(data.get(2..).unwrap_or_default());
        checks::cyberglove_simulator(&data);
    }
}
