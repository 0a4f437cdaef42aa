//! Connects web pages to the vehicles.

use crate::page::PageBackend;
use crate::web::admission::Admission;
use crate::web::client::{ClientEvent, WebState};
use crate::web::listener::listen;
use crate::web::slots::CONNECTIONS_MAX;
use crate::{Server, ServerAction, ServerHook, TimeFlow};
use afbc_web::page_files;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread;
use std::time::Duration;

/// Time between two frames, in flight and during a pause.
const FRAME: Duration = Duration::from_millis(33);
const PAUSED: Duration = Duration::from_millis(250);
/// Largest number of messages of clients that wait for the flight's loop.
const EVENTS_MAX: usize = 32;
/// Time after which a client that accepts nothing is dropped.
const STUCK: Duration = Duration::from_secs(10);

/// Serves the web page in separate threads, and connects it to the server's first vehicle.
pub struct WebServer {
    address: SocketAddr,
    admission: Admission,
    backend: PageBackend,
    /// Message with the data that do not change. It is built once, since that takes longer than a step.
    description: Option<Arc<str>>,
    events: Receiver<ClientEvent>,
    pages: Vec<OpenPage>,
    shown: Duration,
}

/// A page that is open in a browser.
struct OpenPage {
    number: u32,
    from: String,
    out: SyncSender<Arc<str>>,
    /// Time when the page last accepted a frame.
    took: Duration,
}

impl WebServer {
    /// Opens the port; port 0 takes any free one.
    ///
    /// # Errors
    /// Fails with one line that names the address and the remedy.
    pub fn open(address: SocketAddr, admission: Admission) -> Result<Self, String> {
        let listener = TcpListener::bind(address).map_err(|error| taken(address, &error))?;
        let address = listener.local_addr().map_err(|error| taken(address, &error))?;
        let (sender, events) = sync_channel(EVENTS_MAX);
        let shared = Arc::new(WebState { admission: admission.clone(), files: page_files(), events: sender });
        let listen = move || listen(&listener, &shared);
        thread::Builder::new().name("page port".into()).spawn(listen).map_err(|error| taken(address, &error))?;
        let (backend, description, pages, shown) = (PageBackend::new(), None, Vec::new(), Duration::ZERO);
        Ok(WebServer { address, admission, backend, description, events, pages, shown })
    }

    /// Returns the port's address.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Returns the address to open in a browser.
    pub fn url(&self) -> String {
        let token = self.admission.token.as_ref().map_or(String::new(), |token| format!("?token={token}"));
        format!("http://{}/{token}", self.address)
    }

    /// Handles one event only, so that a flood of messages costs a step little.
    fn receive(&mut self, server: &mut Server, now: Duration, log: &mut dyn FnMut(&str)) -> ServerAction {
        let Ok(event) = self.events.try_recv() else { return ServerAction::Nothing };
        let now_s = server.now_s();
        match event {
            ClientEvent::New(number, from, out) if self.pages.len() < CONNECTIONS_MAX => {
                log(&format!("{now_s:.3} page {from} connected"));
                let page = OpenPage { number, from, out, took: now };
                let first = [self.description.clone(), self.backend.values(server).map(Arc::from)];
                first.into_iter().flatten().for_each(|text| drop(page.out.try_send(text)));
                self.pages.push(page);
            }
            // This drops the client's sender, which ends the connection.
            ClientEvent::New(..) => {}
            ClientEvent::Gone(number) => {
                let gone = self.pages.extract_if(.., |page| page.number == number);
                gone.for_each(|page| log(&format!("{now_s:.3} page {} gone", page.from)));
            }
            ClientEvent::Said(number, text) => {
                let reply = self.backend.command(server, &text);
                if let Some(page) = self.pages.iter().find(|page| page.number == number) {
                    // The flight never waits: a page whose queue is full misses the answer.
                    reply.messages.into_iter().for_each(|text| drop(page.out.try_send(text.into())));
                }
                return reply.action;
            }
        }
        ServerAction::Nothing
    }

    /// Sends the current state to every page; drops pages that accept nothing.
    fn show(&mut self, server: &Server, flow: TimeFlow, now: Duration) {
        let Some(frame) = self.backend.frame(server, flow) else { return };
        let frame: Arc<str> = frame.into();
        self.pages.retain_mut(|page| match page.out.try_send(Arc::clone(&frame)) {
            Ok(()) => {
                page.took = now;
                true
            }
            Err(TrySendError::Full(_)) => now.saturating_sub(page.took) < STUCK,
            // The connection has ended, and its `Gone` event, which is logged, will follow.
            Err(TrySendError::Disconnected(_)) => true,
        });
    }
}

impl ServerHook for WebServer {
    fn update(
        &mut self,
        server: &mut Server,
        flow: TimeFlow,
        now: Duration,
        log: &mut dyn FnMut(&str),
    ) -> ServerAction {
        if self.description.is_none() {
            self.description = self.backend.description(server).map(Arc::from);
        }
        let action = self.receive(server, now, log);
        self.backend.update(server);
        // Show the effect of a command at once.
        let wait = if flow.paused && action == ServerAction::Nothing { PAUSED } else { FRAME };
        if now.saturating_sub(self.shown) >= wait && !self.pages.is_empty() {
            self.shown = now;
            self.show(server, flow, now);
        }
        action
    }

    fn sent(&mut self, vehicle: usize, bytes: &[u8]) {
        self.backend.sent(vehicle, bytes);
    }
}

/// Returns why the port cannot be opened.
fn taken(address: SocketAddr, error: &io::Error) -> String {
    let cure = "choose another address, as in --web 127.0.0.1:0 for any free port";
    format!("--web {address}: the address cannot be opened ({error}); {cure}")
}
