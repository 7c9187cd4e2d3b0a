//! Where clients reach a simulated device: a pseudo-terminal or a socket.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};

/// Time between two tries to reach a client that the device dials.
const REDIAL: Duration = Duration::from_millis(300);

/// Where a simulated device can be reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// A pseudo-terminal; a symbolic link of this name leads to it. A link that is
    /// there already is replaced, anything else is not.
    Pty {
        /// Path of the link.
        link: PathBuf,
    },
    /// A socket at which the device listens, for one client at a time.
    TcpListen(SocketAddr),
    /// A client that listens and that the device dials, as the CyberGlove III does.
    TcpDial(SocketAddr),
}

/// An endpoint in use.
pub(super) enum Wire {
    Pty(Pty),
    Tcp(Tcp),
}

/// What reading or writing came to.
pub(super) enum Outcome {
    /// That many bytes.
    Bytes(usize),
    /// None at the moment.
    NotNow,
    /// Nobody is there, or no longer.
    Nobody,
}

impl Wire {
    pub(super) fn open(endpoint: &Endpoint) -> io::Result<Self> {
        Ok(match endpoint {
            Endpoint::Pty { link } => Self::Pty(Pty::open(link)?),
            Endpoint::TcpListen(address) => {
                let listener = TcpListener::bind(address)?;
                listener.set_nonblocking(true)?;
                Self::Tcp(Tcp::new(Peer::Listener(listener)))
            }
            Endpoint::TcpDial(address) => Self::Tcp(Tcp::new(Peer::Dialled(*address))),
        })
    }

    /// The address a socket listens at.
    pub(super) fn local_address(&self) -> Option<SocketAddr> {
        match self {
            Self::Tcp(Tcp {
                peer: Peer::Listener(listener),
                ..
            }) => listener.local_addr().ok(),
            _ => None,
        }
    }

    /// Waits until there is something to read or the time is over. Then looks for
    /// a client if there is none; says whether one has come.
    pub(super) fn wait(&mut self, duration: Duration) -> io::Result<bool> {
        let fd = match self {
            Self::Pty(pty) => Some(pty.master.as_fd()),
            Self::Tcp(tcp) => tcp.fd(),
        };
        match fd {
            Some(fd) => wait_readable(fd, duration)?,
            None => std::thread::sleep(duration),
        }
        match self {
            Self::Pty(_) => Ok(false),
            Self::Tcp(tcp) => tcp.look_for_client(),
        }
    }

    pub(super) fn read(&mut self, buffer: &mut [u8]) -> Outcome {
        match self {
            Self::Pty(pty) => outcome((&pty.master).read(buffer)),
            Self::Tcp(tcp) => tcp.with_stream(|stream| outcome(stream.read(buffer))),
        }
    }

    /// Writes bytes; those that the client leaves no room for are lost.
    pub(super) fn write(&mut self, bytes: &[u8]) -> Outcome {
        match self {
            Self::Pty(pty) => {
                let written = outcome((&pty.master).write(bytes));
                if matches!(written, Outcome::NotNow) {
                    // Nobody reads. Rather the newest bytes than the oldest.
                    let _ = tcflush(&pty.slave, QueueSelector::IFlush);
                }
                written
            }
            Self::Tcp(tcp) => tcp.with_stream(|stream| outcome(stream.write(bytes))),
        }
    }
}

fn outcome(result: io::Result<usize>) -> Outcome {
    match result {
        Ok(0) => Outcome::Nobody,
        Ok(count) => Outcome::Bytes(count),
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted
            ) =>
        {
            Outcome::NotNow
        }
        Err(_) => Outcome::Nobody,
    }
}

fn wait_readable(fd: BorrowedFd<'_>, duration: Duration) -> io::Result<()> {
    let mut fds = [PollFd::from_borrowed_fd(fd, PollFlags::IN)];
    let timeout = Timespec {
        tv_sec: duration.as_secs().try_into().unwrap_or(i64::MAX),
        tv_nsec: duration.subsec_nanos().into(),
    };
    match poll(&mut fds, Some(&timeout)) {
        Ok(_) | Err(rustix::io::Errno::INTR) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// The device's end of a pseudo-terminal.
///
/// The client's end is kept open as well: it stays in raw mode between clients,
/// and reading does not fail while there is none.
pub(super) struct Pty {
    master: File,
    slave: OwnedFd,
    name: PathBuf,
    link: PathBuf,
}

impl Pty {
    fn open(link: &Path) -> io::Result<Self> {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&master)?;
        unlockpt(&master)?;
        let name = PathBuf::from(OsStr::from_bytes(ptsname(&master, Vec::new())?.as_bytes()));
        let slave = rustix::fs::open(
            &name,
            OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC,
            Mode::empty(),
        )?;
        let mut settings = tcgetattr(&slave)?;
        settings.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &settings)?;
        rustix::io::ioctl_fionbio(&master, true)?;
        place_link(&name, link)?;
        Ok(Self {
            master: File::from(master),
            slave,
            name,
            link: link.to_owned(),
        })
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        // Only a link of our own: another simulator may have taken the name.
        if fs::read_link(&self.link).is_ok_and(|target| target == self.name) {
            let _ = fs::remove_file(&self.link);
        }
    }
}

/// Makes a symbolic link, in place of another one but of nothing else.
fn place_link(target: &Path, link: &Path) -> io::Result<()> {
    match fs::symlink_metadata(link) {
        Ok(found) if found.is_symlink() => fs::remove_file(link)?,
        Ok(_) => {
            return Err(io::Error::new(
                io::ErrorKind::AlreadyExists,
                format!("{} exists and is no symbolic link", link.display()),
            ));
        }
        Err(_) => {}
    }
    std::os::unix::fs::symlink(target, link)
        .map_err(|error| io::Error::new(error.kind(), format!("{}: {error}", link.display())))
}

enum Peer {
    Listener(TcpListener),
    Dialled(SocketAddr),
}

/// A socket, with or without a client.
pub(super) struct Tcp {
    peer: Peer,
    stream: Option<TcpStream>,
    last_dial: Option<Instant>,
}

impl Tcp {
    fn new(peer: Peer) -> Self {
        Self {
            peer,
            stream: None,
            last_dial: None,
        }
    }

    fn fd(&self) -> Option<BorrowedFd<'_>> {
        match (&self.stream, &self.peer) {
            (Some(stream), _) => Some(stream.as_fd()),
            (None, Peer::Listener(listener)) => Some(listener.as_fd()),
            (None, Peer::Dialled(_)) => None,
        }
    }

    fn look_for_client(&mut self) -> io::Result<bool> {
        if self.stream.is_some() {
            return Ok(false);
        }
        let found = match &self.peer {
            Peer::Listener(listener) => listener.accept().map(|(stream, _)| stream),
            Peer::Dialled(address) => {
                if self.last_dial.is_some_and(|last| last.elapsed() < REDIAL) {
                    return Ok(false);
                }
                self.last_dial = Some(Instant::now());
                TcpStream::connect_timeout(address, REDIAL)
            }
        };
        // Nobody yet, or someone who left before the answer: look again later.
        let Ok(stream) = found else {
            return Ok(false);
        };
        stream.set_nonblocking(true)?;
        stream.set_nodelay(true)?;
        self.stream = Some(stream);
        Ok(true)
    }

    fn with_stream(&mut self, run: impl FnOnce(&mut TcpStream) -> Outcome) -> Outcome {
        let Some(stream) = &mut self.stream else {
            return Outcome::Nobody;
        };
        let outcome = run(stream);
        if matches!(outcome, Outcome::Nobody) {
            self.stream = None;
        }
        outcome
    }
}
