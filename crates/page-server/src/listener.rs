//! The port, and a thread for each connection.

use crate::client::{Shared, serve};
use std::io::ErrorKind;
use std::net::TcpListener;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Most connections at a time; others are closed at once.
pub const CONNECTIONS_MAX: usize = 24;
/// Wait after a failure to accept, such as too many open files.
const NAP: Duration = Duration::from_millis(50);

/// Accepts connections for as long as the program runs.
pub(crate) fn listen(listener: &TcpListener, shared: &Arc<Shared>) {
    let open = Arc::new(AtomicUsize::new(0));
    let mut number: u32 = 0;
    loop {
        let stream = match listener.accept() {
            Ok((stream, _)) => stream,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(_) => {
                thread::sleep(NAP);
                continue;
            }
        };
        if open.load(Ordering::Acquire) >= CONNECTIONS_MAX {
            continue;
        }
        open.fetch_add(1, Ordering::AcqRel);
        number = number.wrapping_add(1);
        let (shared, counted) = (Arc::clone(shared), Counted(Arc::clone(&open)));
        // Without a thread, the connection is closed and no longer counted.
        let _ = thread::Builder::new().name("page".into()).spawn(move || {
            let _counted = counted;
            // How a connection ends is its own business.
            let _ = serve(stream, number, &shared);
        });
    }
}

/// A connection that is counted until this is dropped.
struct Counted(Arc<AtomicUsize>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}
