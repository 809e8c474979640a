//! A serial port: a real rig on USB, or the pseudo-terminal of an emulated one.

use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

use serialport::{ClearBuffer, SerialPort};

use super::{Transport, TransportError};

#[cfg(unix)]
type NativePort = serialport::TTYPort;
#[cfg(windows)]
type NativePort = serialport::COMPort;

/// Longest wait for the port to take one frame.
const WRITE_TIMEOUT: Duration = Duration::from_millis(20);

/// A serial port.
#[derive(Debug)]
pub struct SerialTransport {
    port: NativePort,
    name: String,
    timeout: Duration,
}

impl SerialTransport {
    /// Bits per second where nothing else is said. Meaningless for pseudo-terminals and most USB devices.
    pub const BAUD: u32 = 921_600;

    /// Opens a port (8 data bits, no parity, one stop bit, no flow control), for this process alone.
    ///
    /// # Errors
    /// [`TransportError::NoSuchPort`], [`TransportError::NotAPort`], [`TransportError::Refused`].
    pub fn open(name: &str, baud: u32) -> Result<Self, TransportError> {
        if let Some(what) = no_device(name) {
            return Err(TransportError::NotAPort {
                port: name.to_owned(),
                what,
                present: present(),
            });
        }
        let port = serialport::new(name, baud)
            .timeout(WRITE_TIMEOUT)
            .open_native()
            .map_err(|error| {
                // serialport reports a missing device as Io(NotFound), an unsuitable path as NoDevice.
                match error.kind {
                    serialport::ErrorKind::NoDevice
                    | serialport::ErrorKind::Io(ErrorKind::NotFound)
                        if !std::path::Path::new(name).exists() =>
                    {
                        TransportError::NoSuchPort {
                            port: name.to_owned(),
                            present: present(),
                        }
                    }
                    _ => TransportError::Refused {
                        port: name.to_owned(),
                        reason: error.description,
                    },
                }
            })?;
        Ok(Self {
            port,
            name: name.to_owned(),
            timeout: WRITE_TIMEOUT,
        })
    }

    fn wait(&mut self, timeout: Duration) -> Result<(), TransportError> {
        if self.timeout != timeout {
            self.port
                .set_timeout(timeout)
                .map_err(|e| self.lost(e.into()))?;
            self.timeout = timeout;
        }
        Ok(())
    }

    /// What an unplugged port says differs: EIO, ENXIO, EPIPE or end of file, by driver and moment.
    fn lost(&self, source: std::io::Error) -> TransportError {
        const EIO: i32 = 5;
        const ENXIO: i32 = 6;
        const ENODEV: i32 = 19;
        let port = self.name.clone();
        let gone = matches!(
            source.kind(),
            ErrorKind::BrokenPipe
                | ErrorKind::UnexpectedEof
                | ErrorKind::NotConnected
                | ErrorKind::NotFound
        ) || matches!(source.raw_os_error(), Some(EIO | ENXIO | ENODEV))
            || !std::path::Path::new(&self.name).exists();
        if gone {
            TransportError::Unplugged { port }
        } else {
            TransportError::Io { port, source }
        }
    }
}

impl Transport for SerialTransport {
    fn read(&mut self, buffer: &mut [u8], timeout: Duration) -> Result<usize, TransportError> {
        self.wait(timeout)?;
        match self.port.read(buffer) {
            // The port said there was something to read, and there is nothing: the other end has hung up.
            Ok(0) if !buffer.is_empty() => Err(self.lost(ErrorKind::UnexpectedEof.into())),
            Ok(n) => Ok(n),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            Err(e) => Err(self.lost(e)),
        }
    }

    fn write(&mut self, mut bytes: &[u8]) -> Result<(), TransportError> {
        self.wait(WRITE_TIMEOUT)?;
        while !bytes.is_empty() {
            match self.port.write(bytes) {
                Ok(n) => bytes = bytes.get(n..).unwrap_or_default(),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if e.kind() == ErrorKind::TimedOut => {
                    return Err(TransportError::Stuck {
                        port: self.name.clone(),
                    });
                }
                Err(e) => return Err(self.lost(e)),
            }
        }
        Ok(())
    }

    fn discard_input(&mut self) -> Result<(), TransportError> {
        self.port
            .clear(ClearBuffer::Input)
            .map_err(|e| self.lost(e.into()))
    }

    fn now(&self) -> Instant {
        Instant::now()
    }
}

/// What a path leads to, where it is no device.
fn no_device(path: &str) -> Option<&'static str> {
    let kind = std::fs::metadata(path).ok()?.file_type();
    if kind.is_file() {
        return Some("a file");
    }
    if kind.is_dir() {
        return Some("a folder");
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a pipe");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
    }
    None
}

fn present() -> String {
    let ports = serialport::available_ports().unwrap_or_default();
    if ports.is_empty() {
        return "none".to_owned();
    }
    ports
        .into_iter()
        .map(|p| p.port_name)
        .collect::<Vec<_>>()
        .join(", ")
}
