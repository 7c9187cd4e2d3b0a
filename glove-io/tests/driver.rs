//! Drivers against simulated devices on real pseudo-terminals and sockets: they start
//! the device, lose nothing on a good line, and come back after a bad one.
//!
//! Nothing here depends on how fast the machine is: waits are far longer than needed
//! and end when what they wait for happens.

#![cfg(unix)]

use std::path::PathBuf;
use std::time::Duration;

use glove_io::Pose;
use glove_io::driver::{
    Backoff, CyberGlove, Driver, DriverError, Fastrak, Options, StartError, State, serial,
    tcp_client, tcp_listener,
};
use glove_io::fastrak::Station;
use glove_io::sim::{
    self,
    host::{Endpoint, Host, Options as LineOptions},
};

/// Longer than anything takes here.
const PATIENCE: Duration = Duration::from_secs(30);

/// A name for a pseudo-terminal that no other test has.
fn link(name: &str) -> (PathBuf, Endpoint) {
    let path = std::env::temp_dir().join(format!("glove-io-{}-{name}", std::process::id()));
    (path.clone(), Endpoint::Pty { link: path })
}

/// Quick to try again, so that tests need not wait.
fn options() -> Options {
    Options {
        silence: Duration::from_millis(400),
        backoff: Backoff {
            first: Duration::from_millis(20),
            longest: Duration::from_millis(100),
        },
        ..Options::default()
    }
}

/// Sensor 0 counts ticks, so that a lost or repeated record shows.
fn counting_glove(endpoint: &Endpoint) -> Host {
    let mut count = 0_u8;
    Host::spawn(
        endpoint,
        sim::CyberGlove::default(),
        move |glove, _| {
            count = count % 255 + 1;
            let mut sensors = [100; 22];
            sensors[0] = count;
            glove.set_sensors(sensors);
        },
        LineOptions::default(),
    )
    .expect("a pseudo-terminal can be opened")
}

fn still_tracker(endpoint: &Endpoint) -> Host {
    let mut tracker = sim::Fastrak::default();
    let pose = Pose {
        position_m: [0.1, 0.2, -0.3],
        ..Pose::IDENTITY
    };
    tracker.set_pose(Station::One, pose).expect("in range");
    Host::spawn(endpoint, tracker, |_, _| {}, LineOptions::default()).expect("it can be opened")
}

#[test]
fn a_streaming_glove_loses_no_record() {
    let (path, endpoint) = link("stream");
    let _host = counting_glove(&endpoint);
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::default(),
        options(),
    )
    .unwrap();
    let every = glove.subscribe(100);
    let samples: Vec<_> = (0..50)
        .map(|_| every.recv_timeout(PATIENCE).expect("the glove streams"))
        .collect();
    for pair in samples.windows(2) {
        let [before, after] = [pair[0].value.sensors()[0], pair[1].value.sensors()[0]];
        assert_eq!(after, before % 255 + 1, "no record is missing");
        assert_eq!(pair[1].sequence, pair[0].sequence + 1);
        assert!(pair[1].first_byte >= pair[0].last_byte);
        assert!(pair[1].last_byte >= pair[1].first_byte);
    }
    assert!(samples[0].value.streamed && samples[0].value.status.is_some());
    let status = glove.status();
    assert_eq!((status.state, status.starts), (State::Running, 1));
    assert_eq!(status.counters.dropped_bytes, 0);
    assert!(status.error.is_none());
    glove.stop();
    // The channel closes with the driver.
    while every.try_recv().is_ok() {}
    assert!(every.recv().is_err());
}

#[test]
fn a_polled_glove_answers_every_request() {
    let (path, endpoint) = link("poll");
    let host = counting_glove(&endpoint);
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::polled(),
        options(),
    )
    .unwrap();
    let mut last = None;
    for _ in 0..20 {
        let sample = glove.wait_newer(last, PATIENCE).expect("it answers");
        assert!(!sample.value.streamed);
        assert!(last.is_none_or(|last| sample.sequence > last));
        last = Some(sample.sequence);
    }
    drop(glove);
    assert!(host.stats().received_bytes > 20);
}

#[test]
fn the_tracker_reports_its_pose() {
    let (path, endpoint) = link("tracker");
    let _host = still_tracker(&endpoint);
    for device in [Fastrak::default(), Fastrak::polled()] {
        let tracker =
            Driver::spawn(serial(path.to_string_lossy(), 115_200), device, options()).unwrap();
        let sample = tracker.wait_newer(None, PATIENCE).expect("it answers");
        let pose = sample.value.to_world().expect("position and orientation");
        for (found, sent) in pose.position_m.iter().zip([0.1, 0.2, -0.3]) {
            // Centimetres in single precision: half an ulp of a number below 32.
            assert!((found - sent).abs() <= 0.01 * 0.5 * 2.0_f64.powi(5 - 24));
        }
        assert_eq!(
            tracker.newest_of(0).map(|sample| sample.value.station),
            Some(Station::One)
        );
        assert!(tracker.newest_of(1).is_none());
    }
}

#[test]
fn a_pulled_plug_is_noticed_and_the_device_found_again() {
    let (path, endpoint) = link("replug");
    let host = counting_glove(&endpoint);
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::default(),
        options(),
    )
    .unwrap();
    glove.wait_newer(None, PATIENCE).expect("it streams");
    host.unplug(Duration::from_millis(300));
    let lost = glove
        .wait_status(PATIENCE, |status| status.state == State::Waiting)
        .expect("the loss is noticed");
    assert!(matches!(
        lost.error,
        Some(DriverError::Lost(_) | DriverError::Silent { .. })
    ));
    let again = glove
        .wait_status(PATIENCE, |status| status.starts == 2)
        .expect("the device is started again");
    let sample = glove.wait_newer(Some(again.samples), PATIENCE);
    assert!(sample.is_some(), "and streams");
}

#[test]
fn a_silent_device_is_started_again() {
    let (path, endpoint) = link("stall");
    let host = still_tracker(&endpoint);
    let tracker = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        Fastrak::default(),
        options(),
    )
    .unwrap();
    tracker.wait_newer(None, PATIENCE).expect("it streams");
    host.stall(Duration::from_millis(900));
    let lost = tracker
        .wait_status(PATIENCE, |status| status.error.is_some())
        .expect("the silence is noticed");
    assert!(matches!(lost.error, Some(DriverError::Silent { .. })));
    tracker
        .wait_status(PATIENCE, |status| status.starts >= 2)
        .expect("it is started again");
}

#[test]
fn a_glove_that_is_not_plugged_in_is_named() {
    let (path, endpoint) = link("bare");
    let mut bare = sim::CyberGlove::default();
    bare.set_plugged_in(false);
    let _host = Host::spawn(&endpoint, bare, |_, _| {}, LineOptions::default()).unwrap();
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::default(),
        options(),
    )
    .unwrap();
    let status = glove
        .wait_status(PATIENCE, |status| status.error.is_some())
        .expect("the start fails");
    let error = status.error.unwrap();
    assert!(
        matches!(error, DriverError::Start(StartError::Refused { .. })),
        "{error}"
    );
    assert!(
        error.to_string().contains("no glove is plugged in"),
        "{error}"
    );
}

#[test]
fn a_missing_port_is_waited_for() {
    let (path, endpoint) = link("late");
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::default(),
        options(),
    )
    .unwrap();
    let status = glove
        .wait_status(PATIENCE, |status| status.error.is_some())
        .expect("there is no port");
    let error = status.error.unwrap();
    assert!(matches!(error, DriverError::Connect(_)), "{error}");
    assert!(
        error.to_string().contains(&*path.to_string_lossy()),
        "the message names the port: {error}"
    );
    let _host = counting_glove(&endpoint);
    assert!(glove.wait_newer(None, PATIENCE).is_some());
}

#[test]
fn a_glove_dials_the_host() {
    let (address, connect) = tcp_listener("127.0.0.1:0").unwrap();
    let _host = counting_glove(&Endpoint::TcpDial(address));
    let glove = Driver::spawn(connect, CyberGlove::default(), options()).unwrap();
    assert!(glove.wait_newer(None, PATIENCE).is_some());
}

#[test]
fn a_tracker_behind_a_socket_comes_back() {
    let any_port = "127.0.0.1:0".parse().unwrap();
    let host = still_tracker(&Endpoint::TcpListen(any_port));
    let address = host.address().expect("it listens").to_string();
    let tracker = Driver::spawn(tcp_client(address), Fastrak::default(), options()).unwrap();
    tracker.wait_newer(None, PATIENCE).expect("it streams");
    host.unplug(Duration::from_millis(200));
    tracker
        .wait_status(PATIENCE, |status| status.starts == 2)
        .expect("the device is started again");
}

#[test]
fn a_slow_subscriber_never_holds_the_driver_up() {
    let (path, endpoint) = link("slow");
    let _host = counting_glove(&endpoint);
    let glove = Driver::spawn(
        serial(path.to_string_lossy(), 115_200),
        CyberGlove::default(),
        options(),
    )
    .unwrap();
    let every = glove.subscribe(3);
    let status = glove
        .wait_status(PATIENCE, |status| status.dropped_samples >= 5)
        .expect("what does not fit is dropped");
    assert_eq!(status.state, State::Running);
    let kept: Vec<_> = (0..3).map(|_| every.recv().unwrap().sequence).collect();
    assert_eq!(kept, [kept[0], kept[0] + 1, kept[0] + 2]);
}

#[test]
fn a_file_in_the_place_of_the_link_is_left_alone() {
    let (path, endpoint) = link("taken");
    std::fs::write(&path, "mine").unwrap();
    let refused = Host::spawn(
        &endpoint,
        sim::CyberGlove::default(),
        |_, _| {},
        LineOptions::default(),
    );
    assert!(refused.is_err_and(|error| error.kind() == std::io::ErrorKind::AlreadyExists));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
    std::fs::remove_file(&path).unwrap();
}
