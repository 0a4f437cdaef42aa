//! Help for newcomers: how to connect to the vehicles.

use crate::ports::Addresses;
use crate::systems::listed;
use std::net::SocketAddr;

/// Returns how each client connects to the first vehicle. `systems` are the vehicles' system ids, `open` their UDP and
/// TCP addresses.
pub fn guide(addresses: &Addresses, open: &[(SocketAddr, Option<SocketAddr>)], systems: &[u8]) -> String {
    let count = systems.len();
    let what = if count > 1 { "vehicles, system ids" } else { "vehicle, system id" };
    let mut text = format!("{count} {what} {}. Connect by\n", listed(systems));
    let mut add = |client: &str, how: String| text += &format!("  {client:<16}{how}\n");
    if let Some(companion) = addresses.companions.first() {
        let port = companion.port();
        add("MAVSDK-Python", format!("await System().connect(\"udpin://0.0.0.0:{port}\")"));
    }
    if let Some(station) = addresses.stations.first() {
        let port = station.port();
        add("QGroundControl", format!("connects automatically (UDP port {port})"));
        add("MAVProxy", format!("mavproxy.py --master=udpin:0.0.0.0:{port}"));
        add("pymavlink", format!("mavutil.mavlink_connection(\"udpin:0.0.0.0:{port}\")"));
    }
    if let Some((udp, tcp)) = open.first() {
        add("any, by UDP", format!("send to udpout:{}:{}, the vehicle's own port", reachable(udp), udp.port()));
        if let Some(tcp) = tcp {
            add("any, by TCP", format!("tcp:{}:{}", reachable(tcp), tcp.port()));
        }
    }
    if count > 1 {
        text += "For each further vehicle, MAVSDK's port and the UDP port are 1 higher, the TCP port is 10 higher.\n";
    }
    text += "Lines typed here change weather and faults: wind 5 0 0, fault gnss lost, status, help, quit.\n";
    text
}

/// Returns an address that a client on this machine can reach.
fn reachable(address: &SocketAddr) -> String {
    if address.ip().is_unspecified() { "127.0.0.1".into() } else { address.ip().to_string() }
}
