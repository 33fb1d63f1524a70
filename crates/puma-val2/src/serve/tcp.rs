//! Service on a socket.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::serve::station::Station;

/// Longest time after which a change made through `EmulatorServer::with_emulator` reaches the
/// terminal.
const NAP: Duration = Duration::from_millis(20);

/// Means of ending the thread.
#[derive(Debug)]
pub(super) struct Closing {
    address: SocketAddr,
    over: Arc<AtomicBool>,
}

impl Closing {
    /// Ends the thread. Where it waits for a terminal, a connection wakes it.
    pub(super) fn end(&self) {
        self.over.store(true, Ordering::Release);
        let mut own = self.address;
        if own.ip().is_unspecified() {
            own.set_ip(if own.is_ipv4() {
                std::net::Ipv4Addr::LOCALHOST.into()
            } else {
                std::net::Ipv6Addr::LOCALHOST.into()
            });
        }
        let _ = TcpStream::connect_timeout(&own, Duration::from_secs(1));
    }
}

/// Listens at `addr` and serves the emulator there.
pub(super) fn spawn(
    addr: impl ToSocketAddrs,
    station: &Station,
) -> io::Result<(SocketAddr, Closing, JoinHandle<()>)> {
    let listener = TcpListener::bind(addr)?;
    let address = listener.local_addr()?;
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
    Ok((address, Closing { address, over }, thread))
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
