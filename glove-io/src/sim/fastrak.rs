//! A simulated FASTRAK.

use crate::Pose;
use crate::fastrak::{
    EncodeError, Encoding, Item, MAX_RECORD, OutputList, Record, RecordFormat, Station, Units,
};

/// Characters of an argument command the tracker has room for.
const COMMAND_LEN: usize = 254;
/// Bits of the status record that are always set.
const STATUS_BASE: u16 = 0x3F0;

/// A FASTRAK as it behaves on its serial line.
///
/// | command | effect | reply |
/// |---|---|---|
/// | `P` | one record per active station | records |
/// | `C`, `c` | stream on, off; records with each [`tick`](Self::tick) | records |
/// | `F`, `f` | text, binary | none |
/// | `U`, `u` | inches, centimetres | none |
/// | `S` | status | 55 bytes |
/// | `O`station`,`items | output list (items 0, 1, 2, 4, 11, 50, 51) | none |
/// | `O`station | output list | `2`, station, `O`, two characters per item, CR LF |
/// | `l`station`,`0 or 1 | station off or on | none |
/// | `l`station | active stations | `2`, station, `l`, four digits, CR LF |
/// | `H`, `x`, `v` + arguments | accepted without effect | none |
/// | anything else | none | an error record |
///
/// Argument commands end in CR, LF or both; the others act at once, unless a
/// command has been begun. The simulated poses are free of noise and of the
/// ambiguity of hemispheres, so hemisphere (`H`) and filters (`x`, `v`) have
/// nothing to do. At power-up station 1 is active, every output list is
/// `2,4,1`, the unit is the inch and the format is text.
///
/// # Example
///
/// ```
/// use glove_io::sim::Fastrak;
///
/// let mut tracker = Fastrak::default();
/// let mut reply = Vec::new();
/// tracker.receive(b"O1,2,1\rP", &mut reply);
/// assert_eq!(reply, b"01    0.00   0.00   0.00\r\n");
/// ```
#[derive(Debug, Clone)]
pub struct Fastrak {
    encoding: Encoding,
    units: Units,
    streaming: bool,
    stations: [Receiver; 4],
    /// An argument command without its end. One byte beyond [`COMMAND_LEN`]
    /// marks it as too long; more are not kept.
    command: Vec<u8>,
}

#[derive(Debug, Clone)]
struct Receiver {
    active: bool,
    items: OutputList,
    record: Record,
}

/// Error codes of the tracker.
#[derive(Clone, Copy)]
enum Refusal {
    MissingField = -1,
    NotNumeric = -2,
    OutOfRange = -3,
    Overflow = -5,
    Unknown = -99,
}

impl Fastrak {
    /// A tracker after power-up, all receivers at the transmitter.
    #[must_use]
    pub fn new() -> Self {
        Self {
            encoding: Encoding::Ascii,
            units: Units::Inches,
            streaming: false,
            stations: Station::ALL.map(|station| Receiver {
                active: station == Station::One,
                items: OutputList::DEFAULT,
                record: Record::from_world(station, &Pose::IDENTITY),
            }),
            command: Vec::new(),
        }
    }

    /// Moves a receiver to a pose in the world frame.
    ///
    /// # Errors
    ///
    /// [`EncodeError::OutOfRange`] if the pose cannot be sent in every format:
    /// a coordinate is not finite or beyond 9.99 m, or the orientation is not a
    /// unit quaternion at least roughly (zero, or a component of 10 or more).
    /// The receiver then stays where it was.
    pub fn set_pose(&mut self, station: Station, pose: Pose) -> Result<(), EncodeError> {
        let record = Record::from_world(station, &pose);
        // Text has the narrowest fields, and centimetres the larger numbers.
        let strictest = RecordFormat {
            items: OutputList::short([Item::Position, Item::Quaternion, Item::Angles]),
            encoding: Encoding::Ascii,
            units: Units::Centimetres,
        };
        record.encode(&strictest, &mut [0; MAX_RECORD])?;
        self.stations[index(station)].record = record;
        Ok(())
    }

    /// Takes bytes from the client and appends the answers to `reply`.
    pub fn receive(&mut self, bytes: &[u8], reply: &mut Vec<u8>) {
        for &byte in bytes {
            if matches!(byte, b'\r' | b'\n') {
                let command = std::mem::take(&mut self.command);
                if !command.is_empty()
                    && let Err(refusal) = self.execute(&command, reply)
                {
                    refuse(refusal, &command, reply);
                }
            } else if self.command.is_empty() {
                if !self.single_key(byte, reply) {
                    self.command.push(byte);
                }
            } else if self.command.len() <= COMMAND_LEN {
                self.command.push(byte);
            }
        }
    }

    /// Lets one sample period pass: a streaming tracker appends one record per
    /// active station.
    pub fn tick(&mut self, reply: &mut Vec<u8>) {
        if self.streaming {
            self.sample(reply);
        }
    }

    /// Carries out a command of one byte; `false` if it is not one.
    fn single_key(&mut self, key: u8, reply: &mut Vec<u8>) -> bool {
        match key {
            b'P' => self.sample(reply),
            b'C' => self.streaming = true,
            b'c' => self.streaming = false,
            b'F' => self.encoding = Encoding::Ascii,
            b'f' => self.encoding = Encoding::Binary,
            b'U' => self.units = Units::Inches,
            b'u' => self.units = Units::Centimetres,
            b'S' => self.status(reply),
            // Control codes never begin an argument command.
            control if !control.is_ascii_graphic() => refuse(Refusal::Unknown, &[control], reply),
            _ => return false,
        }
        true
    }

    /// Carries out a command with arguments.
    fn execute(&mut self, command: &[u8], reply: &mut Vec<u8>) -> Result<(), Refusal> {
        if command.len() > COMMAND_LEN {
            return Err(Refusal::Overflow);
        }
        let (&letter, arguments) = command.split_first().ok_or(Refusal::MissingField)?;
        match letter {
            b'O' => self.output_list(arguments, reply),
            b'l' => self.active_station(arguments, reply),
            b'H' | b'x' | b'v' if arguments.is_empty() => Err(Refusal::MissingField),
            b'H' | b'x' | b'v' => Ok(()),
            _ => Err(Refusal::Unknown),
        }
    }

    fn output_list(&mut self, arguments: &[u8], reply: &mut Vec<u8>) -> Result<(), Refusal> {
        let mut fields = arguments.split(|&byte| byte == b',');
        let station = parse_station(fields.next())?;
        let items = fields
            .map(|field| Item::from_code(parse_number(field)?).ok_or(Refusal::OutOfRange))
            .collect::<Result<Vec<_>, _>>()?;
        let receiver = &mut self.stations[index(station)];
        if items.is_empty() {
            reply.extend([b'2', b'0' + station.number(), b'O']);
            for item in receiver.items.items() {
                reply.extend(format!("{:2}", item.code()).bytes());
            }
            reply.extend(b"\r\n");
        } else {
            receiver.items = OutputList::try_new(&items).map_err(|_| Refusal::Overflow)?;
        }
        Ok(())
    }

    fn active_station(&mut self, arguments: &[u8], reply: &mut Vec<u8>) -> Result<(), Refusal> {
        let mut fields = arguments.split(|&byte| byte == b',');
        let station = parse_station(fields.next())?;
        match (fields.next().map(parse_number).transpose()?, fields.next()) {
            (None, _) => {
                reply.extend([b'2', b'0' + station.number(), b'l']);
                reply.extend(self.stations.iter().map(|s| b'0' + u8::from(s.active)));
                reply.extend(b"\r\n");
            }
            (Some(state @ (0 | 1)), None) => self.stations[index(station)].active = state == 1,
            _ => return Err(Refusal::OutOfRange),
        }
        Ok(())
    }

    fn sample(&self, reply: &mut Vec<u8>) {
        let mut bytes = [0; MAX_RECORD];
        for receiver in self.stations.iter().filter(|receiver| receiver.active) {
            let format = RecordFormat {
                items: receiver.items,
                encoding: self.encoding,
                units: self.units,
            };
            let len = receiver
                .record
                .encode(&format, &mut bytes)
                .expect("set_pose admits only poses that fit every format");
            reply.extend_from_slice(&bytes[..len]);
        }
    }

    fn status(&self, reply: &mut Vec<u8>) {
        let flags = STATUS_BASE
            | u16::from(self.encoding == Encoding::Binary)
            | (u16::from(self.units == Units::Centimetres) << 1)
            | (u16::from(self.streaming) << 3);
        // Flags, no test error, map of systems, firmware version, identification.
        let text = format!(
            "21S{flags:03X}    F31  {:>6}{:32}\r\n",
            "1.0.0", "glove-io simulator"
        );
        reply.extend(text.bytes());
    }
}

impl Default for Fastrak {
    fn default() -> Self {
        Self::new()
    }
}

fn index(station: Station) -> usize {
    usize::from(station.number() - 1)
}

fn parse_station(field: Option<&[u8]>) -> Result<Station, Refusal> {
    let number = parse_number(field.unwrap_or_default())?;
    Station::from_number(number).ok_or(Refusal::OutOfRange)
}

fn parse_number(field: &[u8]) -> Result<u8, Refusal> {
    let digits = field.trim_ascii();
    if digits.is_empty() {
        return Err(Refusal::MissingField);
    }
    if !digits.iter().all(u8::is_ascii_digit) {
        return Err(Refusal::NotNumeric);
    }
    let text = str::from_utf8(digits).expect("digits are UTF-8");
    text.parse().map_err(|_| Refusal::OutOfRange)
}

/// Appends an error record that repeats the command, unprintable bytes as `?`.
fn refuse(refusal: Refusal, command: &[u8], reply: &mut Vec<u8>) {
    reply.extend(b"2 E*ERROR*");
    reply.extend(command.iter().map(|&byte| {
        if byte == b' ' || byte.is_ascii_graphic() {
            byte
        } else {
            b'?'
        }
    }));
    let code = refusal as i8;
    reply.extend(format!("*ERROR* EC {code} *PS 0 *FL 0 *ST 0\r\n").bytes());
}
