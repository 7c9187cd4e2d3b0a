//! How the tracker is started and understood.

use std::time::Duration;

use super::Device;
use super::error::StartError;
use super::line::Line;
use super::replay::{ReplayError, setting};
use crate::Counters;
use crate::fastrak::{Encoding, Item, OutputList, Parser, Record, RecordFormat, Station, Units};
use crate::recording::raw::DeviceDescription;

/// How long the tracker must keep quiet before it is asked something.
const QUIET: Duration = Duration::from_millis(60);
/// How long it may take to report its status.
const PATIENCE: Duration = Duration::from_secs(1);
/// Fruitless tries after which it is re-initialised.
const TRIES_BEFORE_RESET: u32 = 3;
/// How long that takes: about 10 s says the manual.
const RESET: Duration = Duration::from_secs(12);

/// A FASTRAK.
///
/// The start-up ends a stream that may be running (`c`), waits for silence, and
/// believes that this is a tracker when its status record (`S`) arrives. It then
/// sets unit, output list and format. Set commands are not acknowledged, so the
/// first record is the proof; without one the driver starts over. Repeated
/// failures first end a half-typed command, then re-initialise the tracker
/// (`^Y`), as VRPN does.
#[derive(Debug, Clone)]
pub struct Fastrak {
    /// Let the tracker stream (`C`) instead of asking for every record (`P`).
    pub streamed: bool,
    /// What records hold, for every station. Records of binary lists without a
    /// blank or CR LF at the end arrive one late.
    pub items: OutputList,
    /// Text or binary.
    pub encoding: Encoding,
    /// Which stations shall be on. `None` leaves them as the tracker has them.
    pub stations: Option<[bool; 4]>,
    parser: Parser,
}

impl Default for Fastrak {
    /// Streamed binary records of position and quaternion; stations as they are.
    fn default() -> Self {
        Self {
            streamed: true,
            items: OutputList::short([Item::Position, Item::Quaternion, Item::Space]),
            encoding: Encoding::Binary,
            stations: None,
            parser: Parser::new(RecordFormat::default()),
        }
    }
}

impl Fastrak {
    /// Records requested one by one.
    #[must_use]
    pub fn polled() -> Self {
        Self {
            streamed: false,
            ..Self::default()
        }
    }

    fn format(&self) -> RecordFormat {
        RecordFormat {
            items: self.items,
            encoding: self.encoding,
            units: Units::Centimetres,
        }
    }
}

impl Device for Fastrak {
    type Sample = Record;

    const KIND: &'static str = "fastrak";

    fn start(&mut self, line: &mut Line<'_>, attempt: u32) -> Result<(), StartError> {
        if attempt > 0 {
            line.send(b"\r")?;
        }
        if attempt >= TRIES_BEFORE_RESET {
            line.send(b"\x19")?;
            line.pause(RESET)?;
        }
        line.send(b"c")?;
        line.drain(QUIET)?;
        line.ask(b"S", PATIENCE, |heard| Ok(status(heard)))?;
        let mut command = b"u".to_vec();
        for station in Station::ALL {
            let n = station.number();
            if let Some(active) = self.stations {
                let on = u8::from(active[usize::from(n) - 1]);
                command.extend(format!("l{n},{on}\r").bytes());
            }
            command.extend(format!("O{n}").bytes());
            for item in self.items.items() {
                command.extend(format!(",{}", item.code()).bytes());
            }
            command.push(b'\r');
        }
        command.push(match self.encoding {
            Encoding::Ascii => b'F',
            Encoding::Binary => b'f',
        });
        line.send(&command)?;
        self.parser = Parser::new(self.format());
        if self.streamed {
            line.send(b"C")?;
        }
        Ok(())
    }

    fn request(&self) -> Option<&'static [u8]> {
        (!self.streamed).then_some(b"P")
    }

    fn end(&self) -> &'static [u8] {
        b"c"
    }

    fn receive(&mut self, bytes: &[u8], sink: &mut dyn FnMut(Record)) {
        self.parser.push(bytes, sink);
    }

    fn pending(&self) -> usize {
        self.parser.pending()
    }

    fn counters(&self) -> Counters {
        self.parser.counters()
    }

    fn description(&self) -> DeviceDescription {
        let items: Vec<_> = self
            .items
            .items()
            .iter()
            .map(|i| i.code().to_string())
            .collect();
        let encoding = match self.encoding {
            Encoding::Ascii => "text",
            Encoding::Binary => "binary",
        };
        DeviceDescription::new(Self::KIND)
            .with("streamed", if self.streamed { "on" } else { "off" })
            .with("encoding", encoding)
            .with("units", "cm")
            .with("items", items.join(","))
    }

    fn from_description(description: &DeviceDescription) -> Result<Self, ReplayError> {
        let streamed = setting(description, "streamed", |value| match value {
            "on" => Some(true),
            "off" => Some(false),
            _ => None,
        })?;
        let encoding = setting(description, "encoding", |value| match value {
            "text" => Some(Encoding::Ascii),
            "binary" => Some(Encoding::Binary),
            _ => None,
        })?;
        setting(description, "units", |value| (value == "cm").then_some(()))?;
        let items = setting(description, "items", |value| {
            let items: Option<Vec<_>> = value
                .split(',')
                .map(|code| Item::from_code(code.parse().ok()?))
                .collect();
            OutputList::try_new(&items?).ok()
        })?;
        let mut tracker = Self {
            streamed,
            items,
            encoding,
            ..Self::default()
        };
        tracker.parser = Parser::new(tracker.format());
        Ok(tracker)
    }

    fn source(sample: &Record) -> usize {
        usize::from(sample.station.number()) - 1
    }
}

/// Whether a status record was heard: `2`, a station, `S`, and a line of 54 or 55
/// bytes in all.
fn status(heard: &[u8]) -> Option<()> {
    heard.windows(3).enumerate().find_map(|(start, head)| {
        let is_head = head[0] == b'2' && head[2] == b'S';
        let end = heard[start..].iter().position(|&byte| byte == b'\n')?;
        (is_head && matches!(end + 1, 54 | 55)).then_some(())
    })
}
