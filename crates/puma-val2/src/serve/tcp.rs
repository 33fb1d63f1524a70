//! On a socket.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::emulator::controller::Emulator;
use crate::joints::Joints;
use crate::manipulator::Gripper;
use crate::serve::ServeConfig;
use crate::serve::station::Station;

/// Longest time after which a change made through [`TcpServer::with_emulator`] reaches the
/// terminal.
const NAP: Duration = Duration::from_millis(20);

/// An emulated controller on a TCP socket, one terminal at a time; the next one finds the
/// controller as the last one left it.
///
/// The thread that serves it ends when this is dropped.
#[derive(Debug)]
pub struct TcpServer {
    station: Station,
    address: SocketAddr,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl TcpServer {
    /// Listens at `addr` (`127.0.0.1:0` for any free port of this machine alone) and serves
    /// `emulator` there. `config.link` is of no use here.
    ///
    /// # Errors
    /// The address cannot be listened at.
    pub fn spawn(
        addr: impl ToSocketAddrs,
        emulator: Emulator,
        config: ServeConfig,
    ) -> io::Result<Self> {
        let listener = TcpListener::bind(addr)?;
        let address = listener.local_addr()?;
        let station = Station::new(emulator, config.realtime, config.transcript);
        let over = Arc::new(AtomicBool::new(false));
        let thread = std::thread::Builder::new().name("val2-tcp".into()).spawn({
            let (station, over) = (station.clone(), Arc::clone(&over));
            move || {
                while !over.load(Ordering::Acquire) {
                    match listener.accept() {
                        // A terminal that fails is gone; the next may come.
                        Ok((stream, _)) => drop(serve(&station, &stream, &over)),
                        Err(_) => std::thread::sleep(NAP),
                    }
                }
            }
        })?;
        Ok(Self {
            station,
            address,
            over,
            thread: Some(thread),
        })
    }

    /// The address to connect to.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The arm's true joint angles right now.
    pub fn joints(&self) -> Joints {
        self.station.with(|emulator| emulator.joints())
    }

    /// The hand right now.
    pub fn gripper(&self) -> Gripper {
        self.station.with(|emulator| emulator.gripper())
    }

    /// Looks at or changes the emulator: its signals, its arm power, its events.
    pub fn with_emulator<R>(&self, f: impl FnOnce(&mut Emulator) -> R) -> R {
        self.station.with(f)
    }
}

impl Drop for TcpServer {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Release);
        // Whoever waits for a terminal gets one and sees that it is over.
        let mut own = self.address;
        if own.ip().is_unspecified() {
            own.set_ip(if own.is_ipv4() {
                std::net::Ipv4Addr::LOCALHOST.into()
            } else {
                std::net::Ipv6Addr::LOCALHOST.into()
            });
        }
        let _ = TcpStream::connect_timeout(&own, Duration::from_secs(1));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn serve(station: &Station, mut stream: &TcpStream, over: &AtomicBool) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(Duration::from_secs(2)))?;
    let mut input = [0; 4096];
    let mut count = 0;
    while !over.load(Ordering::Acquire) {
        let turn = station.turn(&input[..count], false);
        stream.write_all(&turn.output)?;
        let wait = turn.wait.unwrap_or(NAP).min(NAP);
        stream.set_nonblocking(wait.is_zero())?;
        if !wait.is_zero() {
            stream.set_read_timeout(Some(wait))?;
        }
        count = match stream.read(&mut input) {
            Ok(0) => return Ok(()),
            Ok(count) => count,
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock
                | io::ErrorKind::TimedOut
                | io::ErrorKind::Interrupted => 0,
                _ => return Err(error),
            },
        };
        stream.set_nonblocking(false)?;
    }
    Ok(())
}
