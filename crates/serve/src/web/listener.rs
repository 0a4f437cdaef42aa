//! Listens on the port, with a thread for each connection.

use crate::web::client::{WebState, serve};
use crate::web::slots::ConnectionSlots;
use std::io::ErrorKind;
use std::net::TcpListener;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// Wait after a failed accept, for example if too many files are open.
const NAP: Duration = Duration::from_millis(50);

/// Accepts connections for as long as the program runs.
pub(crate) fn listen(listener: &TcpListener, shared: &Arc<WebState>) {
    let slots = ConnectionSlots::default();
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
        number = number.wrapping_add(1);
        // A client that is already gone needs no place.
        let Ok(slot) = slots.enter(number, &stream) else { continue };
        let shared = Arc::clone(shared);
        // If no thread can be started, the connection is closed and its place becomes free.
        let _ = thread::Builder::new().name("page".into()).spawn(move || {
            // How a connection ends does not matter, so errors are ignored.
            let _ = serve(stream, (number, &slot), &shared);
        });
    }
}
