//! Laws of the FASTRAK's byte stream.

use glove_io::Quaternion;
use glove_io::fastrak::{
    Encoding, Item, MAX_RECORD, OutputList, Parser, Record, RecordFormat, Station, Units,
};
use proptest::prelude::*;

fn record() -> impl Strategy<Value = Record> {
    (
        prop::sample::select(Station::ALL.to_vec()),
        prop::option::of(prop::sample::select(b"xAz".to_vec())),
        [-3.0..3.0_f64, -3.0..3.0, -3.0..3.0],
        [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0],
    )
        .prop_filter_map("a quaternion of some length", |(station, error, p, q)| {
            let [x, y, z, w] = q;
            (x * x + y * y + z * z + w * w > 0.01).then(|| Record {
                station,
                error,
                position_m: Some(p),
                orientation: Quaternion { x, y, z, w }.normalized(),
            })
        })
}

/// Formats whose records end in a blank or CR LF.
fn format() -> impl Strategy<Value = RecordFormat> {
    use Item::{Angles, CrLf, Position, Quaternion, Space};
    (
        prop_oneof![
            Just(OutputList::DEFAULT),
            prop::sample::select(vec![
                vec![Position, Quaternion, Space],
                vec![Space, Quaternion, Position, CrLf],
                vec![Position, Angles, Quaternion, CrLf, Space],
            ])
            .prop_map(|items| OutputList::try_new(&items).expect("a short list")),
        ],
        prop_oneof![Just(Encoding::Ascii), Just(Encoding::Binary)],
        prop_oneof![Just(Units::Inches), Just(Units::Centimetres)],
    )
        .prop_map(|(items, encoding, units)| RecordFormat {
            items,
            encoding,
            units,
        })
}

/// Formats whose records end in a number.
fn format_without_end_mark() -> impl Strategy<Value = RecordFormat> {
    (
        prop::sample::select(vec![
            vec![Item::Position],
            vec![Item::Quaternion, Item::Position],
        ]),
        prop_oneof![Just(Encoding::Ascii), Just(Encoding::Binary)],
    )
        .prop_map(|(items, encoding)| RecordFormat {
            items: OutputList::try_new(&items).expect("a short list"),
            encoding,
            units: Units::Inches,
        })
}

/// Bytes, among them many that matter.
fn byte() -> impl Strategy<Value = u8> {
    prop_oneof![any::<u8>(), prop::sample::select(b" 0123x\r\n".to_vec())]
}

fn encode(format: &RecordFormat, records: &[Record]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for record in records {
        let mut out = [0; MAX_RECORD];
        let len = record.encode(format, &mut out).expect("everything fits");
        assert_eq!(len, format.record_len());
        bytes.extend(&out[..len]);
    }
    bytes
}

fn parse(format: RecordFormat, bytes: &[u8]) -> (Vec<Record>, Parser) {
    let mut parser = Parser::new(format);
    let mut records = Vec::new();
    parser.push(bytes, |record| records.push(record));
    (records, parser)
}

/// What is left of records after rounding to the digits of the format.
fn rounded(format: RecordFormat, records: &[Record]) -> Vec<Record> {
    parse(format, &encode(&format, records)).0
}

fn differ_in_one(a: &[Record], b: &[Record]) -> bool {
    let prefix = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let (a, b) = (&a[prefix..], &b[prefix..]);
    let suffix = a.iter().rev().zip(b.iter().rev());
    let suffix = suffix.take_while(|(a, b)| a == b).count();
    a.len() - suffix <= 1 && b.len() - suffix <= 1
}

proptest! {
    /// Parsing what was encoded gives the records back, rounded to the digits sent.
    #[test]
    fn parsing_inverts_encoding(
        format in format(),
        records in prop::collection::vec(record(), 1..6),
    ) {
        let (parsed, parser) = parse(format, &encode(&format, &records));
        prop_assert_eq!(parsed.len(), records.len());
        prop_assert_eq!((parser.counters().dropped_bytes, parser.pending()), (0, 0));
        let (length_tol, rotation_tol) = match format.encoding {
            // Half of the last digit, and the roundings of a few operations.
            // Angles: three half digits of 0.01°; a rotation by that angle moves
            // a component of a unit quaternion by half as much at most.
            Encoding::Ascii => {
                let has_quaternion = format.items.items().contains(&Item::Quaternion);
                let rotation = if has_quaternion { 0.5e-4 } else { 0.75 * 0.01_f64.to_radians() };
                (0.5e-2 * format.units.metres() + 1e-12, rotation + 1e-12)
            }
            // Relative 2⁻²⁴ of 3 m; of 180° in three angles, halved.
            Encoding::Binary => (3.0 * 0.5_f64.powi(24), 1.5 * 3.2 * 0.5_f64.powi(24)),
        };
        for (found, sent) in parsed.iter().zip(&records) {
            prop_assert_eq!((found.station, found.error), (sent.station, sent.error));
            let (p, q) = (found.position_m.expect("listed"), sent.position_m.expect("set"));
            for (p, q) in p.into_iter().zip(q) {
                prop_assert!((p - q).abs() <= length_tol, "{p} for {q} m");
            }
            let (a, b) = (found.orientation.expect("listed"), sent.orientation.expect("set"));
            let sign = (a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w).signum();
            for (a, b) in [(a.x, b.x), (a.y, b.y), (a.z, b.z), (a.w, b.w)] {
                prop_assert!((a - sign * b).abs() <= rotation_tol, "{a} for {b}");
            }
        }
    }

    /// Encoding what was parsed gives the same bytes, so nothing is rounded twice.
    #[test]
    fn records_without_angles_are_replayed_to_the_byte(
        encoding in prop_oneof![Just(Encoding::Ascii), Just(Encoding::Binary)],
        units in prop_oneof![Just(Units::Inches), Just(Units::Centimetres)],
        records in prop::collection::vec(record(), 1..6),
    ) {
        let items = OutputList::try_new(&[Item::Position, Item::Quaternion, Item::CrLf])?;
        let format = RecordFormat { items, encoding, units };
        let bytes = encode(&format, &records);
        prop_assert_eq!(encode(&format, &parse(format, &bytes).0), bytes);
    }

    /// The pieces in which bytes arrive do not matter.
    #[test]
    fn any_split_gives_the_same_records(
        format in format(),
        noise in prop::collection::vec(prop_oneof![any::<u8>(), Just(b'0'), Just(b'1'), Just(b' ')], 0..80),
        records in prop::collection::vec(record(), 1..6),
        cuts in prop::collection::vec(any::<prop::sample::Index>(), 0..6),
    ) {
        let mut bytes = noise;
        bytes.extend(encode(&format, &records));
        let (whole, reference) = parse(format, &bytes);
        let mut cuts: Vec<_> = cuts.iter().map(|cut| cut.index(bytes.len() + 1)).collect();
        cuts.extend([0, bytes.len()]);
        cuts.sort_unstable();
        let mut parser = Parser::new(format);
        let mut pieces = Vec::new();
        for ends in cuts.windows(2) {
            parser.push(&bytes[ends[0]..ends[1]], |record| pieces.push(record));
        }
        prop_assert_eq!(pieces, whole);
        prop_assert_eq!(parser.counters(), reference.counters());
        prop_assert_eq!(parser.pending(), reference.pending());
    }

    /// Bytes that come one at a time, which no short cut serves, and the same
    /// bytes in larger pieces give the same records and counters, however damaged.
    #[test]
    fn short_cuts_do_not_show(
        format in prop_oneof![4 => format(), 1 => format_without_end_mark()],
        records in prop::collection::vec(record(), 1..16),
        damage in prop::collection::vec((0..4, any::<prop::sample::Index>(), byte()), 0..6),
        pieces in prop::collection::vec(1..200_usize, 1..8),
    ) {
        let mut bytes = encode(&format, &records);
        for (kind, place, byte) in damage {
            let place = place.index(bytes.len());
            match kind {
                0 if bytes.len() > 1 => { bytes.remove(place); }
                1 => bytes.insert(place, byte),
                // Some records, or parts of them, once more.
                2 => bytes.extend_from_within(place..),
                _ => bytes[place] = byte,
            }
            // Six doublings of sixteen records would only cost time.
            bytes.truncate(4000);
        }
        let mut parser = Parser::new(format);
        let mut single = Vec::new();
        for byte in &bytes {
            parser.push(core::slice::from_ref(byte), |record| single.push(record));
        }
        let expected = (single, parser.counters(), parser.pending());

        let (records, whole) = parse(format, &bytes);
        prop_assert_eq!(&(records, whole.counters(), whole.pending()), &expected);

        let mut parser = Parser::new(format);
        let (mut records, mut rest) = (Vec::new(), &bytes[..]);
        for len in pieces.into_iter().cycle() {
            let (piece, later) = rest.split_at(len.min(rest.len()));
            parser.push(piece, |record| records.push(record));
            rest = later;
            if rest.is_empty() {
                break;
            }
        }
        prop_assert_eq!(&(records, parser.counters(), parser.pending()), &expected);
    }

    /// One deleted, inserted or changed byte costs or alters one record at most.
    ///
    /// Two records follow the damage: the first one needs a header after it to
    /// be believed.
    #[test]
    fn one_wrong_byte_harms_one_record(
        format in format(),
        records in prop::collection::vec(record(), 3..7),
        place in any::<prop::sample::Index>(),
        byte in prop_oneof![any::<u8>(), prop::sample::select(b" 0123x\r\n".to_vec())],
        damage in 0..3,
    ) {
        let expected = rounded(format, &records);
        let mut bytes = encode(&format, &records);
        let place = place.index((records.len() - 2) * format.record_len());
        match damage {
            0 => { bytes.remove(place); }
            1 => bytes.insert(place, byte),
            _ => bytes[place] = byte,
        }
        let (parsed, _) = parse(format, &bytes);
        prop_assert!(differ_in_one(&expected, &parsed), "{expected:?} became {parsed:?}");
    }

    /// No bytes panic, and each byte is in a record, dropped or pending.
    #[test]
    fn every_byte_is_accounted_for(
        format in format(),
        bytes in prop::collection::vec(
            prop_oneof![any::<u8>(), prop::sample::select(b" 0123x\r\n".to_vec())],
            0..2000,
        ),
        records in prop::collection::vec(record(), 0..4),
    ) {
        let mut bytes = bytes;
        bytes.extend(encode(&format, &records));
        let (parsed, parser) = parse(format, &bytes);
        let counters = parser.counters();
        prop_assert_eq!(counters.records, parsed.len() as u64);
        let in_records = parsed.len() * format.record_len();
        prop_assert_eq!(
            in_records as u64 + counters.dropped_bytes + parser.pending() as u64,
            bytes.len() as u64
        );
        prop_assert!(parser.pending() < format.record_len() + 3);
    }

    /// Without an end mark every record waits for the next header.
    #[test]
    fn lists_without_an_end_mark_lag_by_one_record(
        encoding in prop_oneof![Just(Encoding::Ascii), Just(Encoding::Binary)],
        records in prop::collection::vec(record(), 1..5),
    ) {
        let items = OutputList::try_new(&[Item::Position, Item::Angles])?;
        let format = RecordFormat { items, encoding, ..RecordFormat::default() };
        let (parsed, parser) = parse(format, &encode(&format, &records));
        prop_assert_eq!(parsed.len(), records.len() - 1);
        prop_assert_eq!(parser.pending(), format.record_len());
        prop_assert_eq!(parser.counters().dropped_bytes, 0);
    }
}

#[test]
fn fields_that_touch_and_zero_padding() {
    for text in [
        "01  -12.34-100.20   0.07 -30.00-120.00 180.00\r\n",
        "01 -012.34-100.20 000.07-030.00-120.00+180.00\r\n",
    ] {
        let (records, _) = parse(RecordFormat::default(), text.as_bytes());
        let inches = [-12.34, -100.2, 0.07];
        assert_eq!(
            records[0].position_m,
            Some(inches.map(|inch: f64| inch * 0.0254))
        );
    }
}

#[test]
fn a_header_character_inside_a_float_is_no_header() {
    // 0x30 is '0': the bytes of this float read "01 x".
    let value = f32::from_le_bytes(*b"01 x");
    assert!(value.is_finite());
    let items = OutputList::try_new(&[Item::Position, Item::Space]).unwrap();
    let format = RecordFormat {
        items,
        encoding: Encoding::Binary,
        units: Units::Centimetres,
    };
    let mut bytes = Vec::new();
    for station in b"1234" {
        bytes.extend([b'0', *station, b' ']);
        bytes.extend(*b"\0\0\0\x0001 x\0\0\0\0 ");
    }
    // Join in the middle of the first record.
    let (records, parser) = parse(format, &bytes[3..]);
    let stations: Vec<_> = records.iter().map(|r| r.station.number()).collect();
    assert_eq!(stations, [2, 3, 4]);
    assert_eq!(parser.counters().resyncs, 1);
}

#[test]
fn text_that_is_no_number_is_refused() {
    for wrong in ["    nan", "  1e3.0", "  12,34", "  12.3 "] {
        let text = format!("01 {wrong}   0.00   0.00   0.00   0.00   0.00\r\n");
        let (records, parser) = parse(RecordFormat::default(), text.as_bytes());
        assert!(records.is_empty(), "{wrong}");
        assert_eq!(parser.counters().resyncs, 1);
    }
}

#[test]
fn the_next_header_exposes_a_lost_byte_where_nothing_else_can() {
    // Any twelve bytes are a position, and the list has no end mark.
    let items = OutputList::try_new(&[Item::Position]).unwrap();
    let format = RecordFormat {
        items,
        encoding: Encoding::Binary,
        units: Units::Inches,
    };
    let mut bytes = Vec::new();
    for station in b"1234" {
        bytes.extend([b'0', *station, b' ']);
        bytes.extend([1.0_f32.to_le_bytes(); 3].concat());
    }
    bytes.remove(5);
    let (records, parser) = parse(format, &bytes);
    let stations: Vec<_> = records.iter().map(|r| r.station.number()).collect();
    assert_eq!(stations, [2, 3]);
    assert_eq!(
        (parser.counters().dropped_bytes, parser.pending()),
        (14, 15)
    );
}
