//! Bytes of both devices to records.
//!
//! The yardstick is the line itself: 115 200 baud carry 11.5 kB/s.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glove_io::{Pose, Quaternion, SENSOR_COUNT, cyberglove, fastrak};

const RECORDS: u8 = 250;

/// Sensor values that differ from record to record, never zero.
fn glove_stream() -> Vec<u8> {
    let mut bytes = Vec::new();
    for n in 0..RECORDS {
        let sensors: [u8; SENSOR_COUNT] = std::array::from_fn(|s| {
            let offset = u8::try_from(11 * s).expect("at most 231");
            n.wrapping_add(offset).max(1)
        });
        let mut out = [0; cyberglove::MAX_RECORD];
        let record = cyberglove::Record::try_new(&sensors).expect("22 values from 1 up");
        let length = record.encode(&mut out);
        bytes.extend(&out[..length]);
    }
    bytes
}

/// The sensor values of [`glove_stream`], as a CyberGlove III sends them.
fn packet_stream() -> Vec<u8> {
    let mut bytes = Vec::new();
    for n in 0..RECORDS {
        let values = std::array::from_fn(|s| {
            let offset = u8::try_from(11 * s).expect("at most 231");
            16 * u16::from(n.wrapping_add(offset))
        });
        let time = cyberglove::TimeCode {
            seconds: n / 30,
            frame: n % 30,
            ..Default::default()
        };
        let packet = cyberglove::Packet::try_new(time, values).expect("12 bits");
        bytes.extend(packet.encode());
    }
    bytes
}

/// A receiver on its way round a circle.
fn tracker_stream(format: &fastrak::RecordFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    for n in 0..RECORDS {
        let (s, c) = (f64::from(n) / f64::from(RECORDS) * std::f64::consts::PI).sin_cos();
        let pose = Pose {
            position_m: [0.3 * c, 0.1, -0.3 * s],
            orientation: Quaternion {
                x: 0.0,
                y: s,
                z: 0.0,
                w: c,
            },
        };
        let mut out = [0; fastrak::MAX_RECORD];
        let record = fastrak::Record::from_world(fastrak::Station::One, &pose);
        let length = record.encode(format, &mut out).expect("within reach");
        bytes.extend(&out[..length]);
    }
    bytes
}

fn parse(c: &mut Criterion) {
    let mut group = c.benchmark_group("parse");

    let bytes = glove_stream();
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("cyberglove", |b| {
        b.iter(|| {
            let mut parser = cyberglove::Parser::new(cyberglove::RecordFormat::default());
            parser.push(black_box(&bytes), |record| {
                black_box(record);
            });
            assert_eq!(parser.counters().records, u64::from(RECORDS));
        });
    });

    let bytes = packet_stream();
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("cyberglove/packets", |b| {
        b.iter(|| {
            let mut parser = cyberglove::PacketParser::new();
            parser.push(black_box(&bytes), |packet| {
                black_box(packet);
            });
            assert_eq!(parser.counters().records, u64::from(RECORDS));
        });
    });

    for (name, encoding) in [
        ("fastrak/ascii", fastrak::Encoding::Ascii),
        ("fastrak/binary", fastrak::Encoding::Binary),
    ] {
        let format = fastrak::RecordFormat {
            encoding,
            ..Default::default()
        };
        let bytes = tracker_stream(&format);
        group.throughput(Throughput::Bytes(bytes.len() as u64));
        group.bench_function(name, |b| {
            b.iter(|| {
                let mut parser = fastrak::Parser::new(format);
                parser.push(black_box(&bytes), |record| {
                    black_box(record);
                });
                assert_eq!(parser.counters().records, u64::from(RECORDS));
            });
        });
    }
    group.finish();
}

criterion_group!(glove, parse);
criterion_main!(glove);
