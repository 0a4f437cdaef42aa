//! UDP and TCP ports of all vehicles.

use crate::peer::PeerEvent;
use crate::server::Server;
use crate::tcp::TcpPort;
use crate::udp::UdpPort;
use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::time::Duration;

/// Difference between the TCP ports of consecutive vehicles, as in ArduPilot.
const TCP_STEP: u16 = 10;

/// Addresses of the vehicles and their clients. Ports are those of the first vehicle.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Addresses {
    /// Local address on which the ports are opened.
    pub bind: IpAddr,
    /// UDP port of the first vehicle; each further vehicle has the next port. 0: any free port.
    pub udp: u16,
    /// Addresses of ground stations, the same for all vehicles.
    pub stations: Vec<SocketAddr>,
    /// Addresses of companion computers; each further vehicle uses the next port.
    pub companions: Vec<SocketAddr>,
    /// TCP port of the first vehicle, if any; each further vehicle is 10 higher. 0: any free port.
    pub tcp: Option<u16>,
}

impl Default for Addresses {
    /// Returns loopback addresses with the ports of PX4's simulation.
    fn default() -> Self {
        let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
        Addresses {
            bind: loopback,
            udp: 18_570,
            stations: vec![(loopback, 14_550).into()],
            companions: vec![(loopback, 14_540).into()],
            tcp: None,
        }
    }
}

/// Open ports of all vehicles.
pub struct Ports {
    vehicles: Vec<(UdpPort, Option<TcpPort>)>,
    /// Number of the last peer.
    next: u32,
}

impl Ports {
    /// Opens the ports for this number of vehicles.
    ///
    /// # Errors
    /// Fails with one line that names the port and the remedy.
    pub fn open(addresses: &Addresses, vehicles: usize) -> Result<Self, String> {
        let Addresses { bind, stations, companions, .. } = addresses;
        let open = |place: usize| {
            let udp = counted(addresses.udp, place, 1)?;
            let companions = companions
                .iter()
                .map(|companion| Ok(SocketAddr::new(companion.ip(), counted(companion.port(), place, 1)?)));
            let companions = companions.collect::<Result<Vec<_>, String>>()?;
            let standing = stations.iter().copied().chain(companions).collect();
            let udp =
                UdpPort::open(*bind, udp, standing).map_err(|error| taken("UDP", *bind, udp, "--port", &error))?;
            let tcp = match addresses.tcp {
                Some(tcp) => {
                    let port = counted(tcp, place, TCP_STEP)?;
                    Some(TcpPort::open(*bind, port).map_err(|error| taken("TCP", *bind, port, "--tcp", &error))?)
                }
                None => None,
            };
            Ok((udp, tcp))
        };
        Ok(Ports { vehicles: (0..vehicles).map(open).collect::<Result<_, String>>()?, next: 0 })
    }

    /// Returns each vehicle's UDP address, and its TCP address if it has one.
    ///
    /// # Errors
    /// Fails if the system does not know a socket's address; this does not happen in practice.
    pub fn addresses(&self) -> io::Result<Vec<(SocketAddr, Option<SocketAddr>)>> {
        let of = |(udp, tcp): &(UdpPort, Option<TcpPort>)| {
            Ok((udp.address()?, tcp.as_ref().map(TcpPort::address).transpose()?))
        };
        self.vehicles.iter().map(of).collect()
    }

    /// Passes the bytes that have arrived by `now` to `server`, and logs new and lost peers.
    pub fn receive(&mut self, server: &mut Server, now: Duration, mut log: impl FnMut(&str)) {
        let Ports { vehicles, next } = self;
        let mut number = || {
            *next = next.wrapping_add(1);
            *next
        };
        for (place, (udp, tcp)) in vehicles.iter_mut().enumerate() {
            let system = server.vehicles().get(place).map_or(0, |vehicle| vehicle.system());
            let now_s = server.now_s();
            let as_of = (now, server.vehicles().get(place).is_some_and(|vehicle| vehicle.needs_signatures()));
            let mut on = |event: PeerEvent<'_>, wire: &str| match event {
                PeerEvent::New(from) => {
                    log(&format!("{now_s:.3} vehicle {system}: {wire} {from} connected"));
                    true
                }
                PeerEvent::Sent(peer, bytes) => server.hear(place, peer, bytes),
                PeerEvent::Nobody(peer) => {
                    server.forget(place, peer);
                    false
                }
                PeerEvent::Foreign(from) => {
                    log(&format!("{now_s:.3} vehicle {system}: {wire} {from} speaks another protocol than MAVLink"));
                    false
                }
                PeerEvent::Gone(from, peer) => {
                    log(&format!("{now_s:.3} vehicle {system}: {wire} {from} gone"));
                    server.forget(place, peer);
                    false
                }
            };
            udp.receive(as_of, &mut number, |event| on(event, "udp"));
            if let Some(tcp) = tcp {
                tcp.receive(as_of, &mut number, |event| on(event, "tcp"));
            }
        }
    }

    /// Sends `bytes` of the vehicle with this index to all its peers.
    pub fn send(&mut self, vehicle: usize, bytes: &[u8]) {
        if let Some((udp, tcp)) = self.vehicles.get_mut(vehicle) {
            udp.send(bytes);
            tcp.iter_mut().for_each(|tcp| tcp.send(bytes));
        }
    }
}

/// Returns the port of the vehicle with this index; 0 (any free port) stays 0.
fn counted(first: u16, place: usize, step: u16) -> Result<u16, String> {
    let port = u16::try_from(place).ok().and_then(|place| place.checked_mul(step)?.checked_add(first));
    match port {
        _ if first == 0 => Ok(0),
        Some(port) => Ok(port),
        None => Err(format!(
            "the ports from {first} on do not suffice for {} vehicles; choose a lower first port",
            place + 1
        )),
    }
}

/// Returns why a port cannot be opened.
fn taken(protocol: &str, address: IpAddr, port: u16, option: &str, error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::AddrInUse => format!(
            "{protocol} port {port} of {address} is taken, perhaps by another sitl serve; end that program, or choose \
             another port by {option}, as in {option} {}, or {option} 0 for any free port",
            port.saturating_add(100)
        ),
        io::ErrorKind::AddrNotAvailable => {
            format!("{address} is no address of this machine; choose one that `ip address` lists, or --bind 0.0.0.0")
        }
        _ => format!("{protocol} port {port} of {address} cannot be opened ({error}); choose another port by {option}"),
    }
}
