//! Where the bytes of a device come from: serial ports and sockets.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::time::{Duration, Instant};

/// The longest time [`Port::read`](Read::read) waits for a byte. A driver looks
/// this often whether it shall stop; a byte that arrives ends the wait at once.
pub const READ_TIMEOUT: Duration = Duration::from_millis(20);

/// How long a write may wait for a peer that does not read.
const WRITE_TIMEOUT: Duration = Duration::from_millis(500);

/// How long [`tcp_listener`] waits for a device before it returns to the driver.
const ACCEPT_TIMEOUT: Duration = Duration::from_millis(200);

/// A two-way stream of bytes to a device.
///
/// A `read` without bytes to return must give up after about [`READ_TIMEOUT`]
/// with [`io::ErrorKind::TimedOut`] or [`io::ErrorKind::WouldBlock`]; `Ok(0)`
/// means that the device is gone.
pub trait Port: Read + Write + Send {}

impl<T: Read + Write + Send> Port for T {}

/// Opens the port of a device, again after every loss of the connection.
pub trait Connect: FnMut() -> io::Result<Box<dyn Port>> + Send + 'static {}

impl<T: FnMut() -> io::Result<Box<dyn Port>> + Send + 'static> Connect for T {}

/// Opens a serial port, 8 data bits, no parity, one stop bit, no flow control.
///
/// A pseudo-terminal of a simulator will do as well; it has any baud rate. What
/// an earlier program left in the port's buffers is thrown away.
///
/// # Example
///
/// ```no_run
/// use glove_io::driver::serial;
///
/// let mut open = serial("/dev/ttyUSB0", 115_200);
/// let port = open()?;
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn serial(path: impl Into<String>, baud: u32) -> impl Connect {
    let path = path.into();
    move || {
        let port = serialport::new(path.as_str(), baud)
            .data_bits(serialport::DataBits::Eight)
            .parity(serialport::Parity::None)
            .stop_bits(serialport::StopBits::One)
            .flow_control(serialport::FlowControl::None)
            .timeout(READ_TIMEOUT)
            .open()
            .map_err(|error| {
                io::Error::new(
                    io::Error::from(error.clone()).kind(),
                    format!("{path}: {error}"),
                )
            })?;
        port.clear(serialport::ClearBuffer::All)?;
        Ok(Box::new(port))
    }
}

/// Connects to a device that listens at `address` (`host:port`).
pub fn tcp_client(address: impl Into<String>) -> impl Connect {
    let address = address.into();
    move || {
        let mut last = io::Error::new(
            io::ErrorKind::NotFound,
            format!("{address}: no address of that name"),
        );
        for place in address.to_socket_addrs()? {
            match TcpStream::connect_timeout(&place, WRITE_TIMEOUT) {
                Ok(stream) => return socket(stream),
                Err(error) => last = error,
            }
        }
        Err(last)
    }
}

/// Waits for a device that dials in, as the CyberGlove III does over Wi-Fi; its
/// maker advises the ports 5200 to 5220.
///
/// Returns the connector and the address it listens at, which tells the port if
/// `address` asked for port 0. While nobody dials, the connector fails with
/// [`io::ErrorKind::TimedOut`] every 0.2 s.
///
/// # Errors
///
/// If the address cannot be listened at.
pub fn tcp_listener(address: impl ToSocketAddrs) -> io::Result<(SocketAddr, impl Connect)> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    let place = listener.local_addr()?;
    let connect = move || {
        let deadline = Instant::now() + ACCEPT_TIMEOUT;
        loop {
            match listener.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    return socket(stream);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {}
                Err(error) => return Err(error),
            }
            if Instant::now() >= deadline {
                return Err(io::Error::new(
                    io::ErrorKind::TimedOut,
                    format!("no device has dialled {place}"),
                ));
            }
            std::thread::sleep(READ_TIMEOUT);
        }
    };
    Ok((place, connect))
}

fn socket(stream: TcpStream) -> io::Result<Box<dyn Port>> {
    stream.set_read_timeout(Some(READ_TIMEOUT))?;
    stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
    stream.set_nodelay(true)?;
    Ok(Box::new(stream))
}
