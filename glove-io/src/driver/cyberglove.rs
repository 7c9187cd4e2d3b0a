//! How the gloves are started and understood.

use std::time::Duration;

use super::Device;
use super::error::StartError;
use super::line::{Line, printable};
use super::replay::{ReplayError, setting};
use crate::Counters;
use crate::cyberglove::{
    Packet, PacketParser, Parser, Query, Record, RecordFormat, Reply, SensorCount, Setting,
    parse_reply,
};
use crate::recording::raw::DeviceDescription;

/// Ends a stream.
const CTRL_C: &[u8] = b"\x03";
/// How long the glove must keep quiet before it is asked something.
const QUIET: Duration = Duration::from_millis(60);
/// How long it may take to answer.
const PATIENCE: Duration = Duration::from_millis(500);

/// A CyberGlove I or II, or a III in its old commands.
///
/// The start-up ends a stream that may be running, asks whether the glove is
/// ready (`?G`) and how many sensors it has (`?S`), and sets what records shall
/// hold (`N`, `U`, `D`). Then records are requested with `G` or streamed with `S`.
#[derive(Debug, Clone)]
pub struct CyberGlove {
    /// Let the glove stream (`S`) instead of asking for every record (`G`).
    pub streamed: bool,
    /// Have a status byte in records: wrist switch, light, glove plugged in.
    pub status: bool,
    /// Have a time stamp in records.
    pub time_stamp: bool,
    format: RecordFormat,
    parser: Parser,
}

impl Default for CyberGlove {
    /// Streamed records with a status byte.
    fn default() -> Self {
        Self {
            streamed: true,
            status: true,
            time_stamp: false,
            format: RecordFormat::default(),
            parser: Parser::new(RecordFormat::default()),
        }
    }
}

impl CyberGlove {
    /// Records requested one by one, with a status byte.
    #[must_use]
    pub fn polled() -> Self {
        Self {
            streamed: false,
            ..Self::default()
        }
    }
}

impl Device for CyberGlove {
    type Sample = Record;

    const KIND: &'static str = "cyberglove";

    fn start(&mut self, line: &mut Line<'_>, _attempt: u32) -> Result<(), StartError> {
        line.send(CTRL_C)?;
        line.drain(QUIET)?;
        if let Reply::GloveState {
            plugged_in: false, ..
        } = ask(line, &Query::GloveState.command())?
        {
            return Err(StartError::Refused {
                command: "?G".to_owned(),
                answer: "bit 1 clear".to_owned(),
                meaning: "no glove is plugged in",
            });
        }
        let Reply::SensorsPresent(count) = ask(line, &Query::SensorsPresent.command())? else {
            unreachable!("only this reply has the letter S");
        };
        let sensors = match count {
            18 => SensorCount::Eighteen,
            22 => SensorCount::TwentyTwo,
            _ => {
                return Err(StartError::Refused {
                    command: "?S".to_owned(),
                    answer: count.to_string(),
                    meaning: "a glove has 18 or 22 sensors",
                });
            }
        };
        for setting in [
            Setting::SensorsSampled(count),
            Setting::StatusByte(self.status),
            Setting::TimeStamp(self.time_stamp),
        ] {
            let mut command = [0; 5];
            let len = setting.encode(&mut command);
            ask(line, &command[..len])?;
        }
        self.format = RecordFormat {
            sensors,
            time_stamp: self.time_stamp,
            status: self.status,
        };
        self.parser = Parser::new(self.format);
        if self.streamed {
            line.send(b"S")?;
        }
        Ok(())
    }

    fn request(&self) -> Option<&'static [u8]> {
        (!self.streamed).then_some(b"G")
    }

    fn end(&self) -> &'static [u8] {
        CTRL_C
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
        let flag = |on: bool| if on { "on" } else { "off" };
        DeviceDescription::new(Self::KIND)
            .with("streamed", flag(self.streamed))
            .with("sensors", self.format.sensors.get().to_string())
            .with("time_stamp", flag(self.format.time_stamp))
            .with("status", flag(self.format.status))
    }

    fn from_description(description: &DeviceDescription) -> Result<Self, ReplayError> {
        let flag = |key| {
            setting(description, key, |value| match value {
                "on" => Some(true),
                "off" => Some(false),
                _ => None,
            })
        };
        let format = RecordFormat {
            sensors: setting(description, "sensors", |value| match value {
                "18" => Some(SensorCount::Eighteen),
                "22" => Some(SensorCount::TwentyTwo),
                _ => None,
            })?,
            time_stamp: flag("time_stamp")?,
            status: flag("status")?,
        };
        Ok(Self {
            streamed: flag("streamed")?,
            status: format.status,
            time_stamp: format.time_stamp,
            format,
            parser: Parser::new(format),
        })
    }
}

/// Asks for something that has a reply of known length and waits for it.
fn ask(line: &mut Line<'_>, command: &[u8]) -> Result<Reply, StartError> {
    // A reply repeats the letter it answers: `?G` is answered with `?G…`, `N` with `N`.
    let expected = match command {
        [b'?', letter, ..] => [b'?', *letter],
        [letter, ..] => [*letter, 0],
        [] => [0, 0],
    };
    line.ask(command, PATIENCE, |heard| {
        // What is left of a stream may precede the reply.
        for start in 0..heard.len() {
            let rest = &heard[start..];
            if let Ok(Some((reply, _))) = parse_reply(rest) {
                if let Reply::Refused(error) = reply {
                    return Err(StartError::Refused {
                        command: printable(command),
                        answer: printable(rest),
                        meaning: error.meaning(),
                    });
                }
                if rest.starts_with(&expected) {
                    return Ok(Some(reply));
                }
            }
        }
        Ok(None)
    })
}

/// A CyberGlove III that streams 12-bit packets (`1S`).
///
/// The start-up ends a stream that may be running (Ctrl-C), sends the glove where
/// the samples shall go (`1E`), and starts the stream. The echoes of the commands
/// are not waited for: sources differ in whether and when they come.
#[derive(Debug, Clone, Default)]
pub struct CyberGlove3 {
    /// The seven digits of `1E`: rate multiplier (30 samples a second times 1 to
    /// 4), whether SD card, USB and Wi-Fi get samples, and their dividers. `None`
    /// leaves the glove as it is set.
    pub enable: Option<[u8; 7]>,
    parser: PacketParser,
}

impl CyberGlove3 {
    /// 90 samples a second over USB.
    pub const USB_90: [u8; 7] = *b"3010111";
    /// 90 samples a second over Wi-Fi.
    pub const WIFI_90: [u8; 7] = *b"3001111";
}

impl Device for CyberGlove3 {
    type Sample = Packet;

    const KIND: &'static str = "cyberglove-3";

    fn start(&mut self, line: &mut Line<'_>, _attempt: u32) -> Result<(), StartError> {
        line.send(CTRL_C)?;
        line.drain(QUIET)?;
        if let Some(digits) = self.enable {
            let mut command = *b"1E0000000";
            command[2..].copy_from_slice(&digits);
            line.send(&command)?;
            line.drain(QUIET)?;
        }
        self.parser = PacketParser::default();
        line.send(b"1S")
    }

    fn request(&self) -> Option<&'static [u8]> {
        None
    }

    fn end(&self) -> &'static [u8] {
        CTRL_C
    }

    fn receive(&mut self, bytes: &[u8], sink: &mut dyn FnMut(Packet)) {
        self.parser.push(bytes, sink);
    }

    fn pending(&self) -> usize {
        self.parser.pending()
    }

    fn counters(&self) -> Counters {
        self.parser.counters()
    }

    fn description(&self) -> DeviceDescription {
        DeviceDescription::new(Self::KIND)
    }

    fn from_description(_: &DeviceDescription) -> Result<Self, ReplayError> {
        Ok(Self::default())
    }
}
