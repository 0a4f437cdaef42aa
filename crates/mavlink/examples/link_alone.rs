//! Uses the link alone: encodes a heartbeat, then decodes it from a stream that begins with noise. Run it with `cargo
//! run -p afbc-mavlink --example link_alone`.

use afbc_mavlink::{Address, Decoder, Encoder, FRAME_MAX, Uplink};

fn main() {
    let (station, vehicle) = (Address { system: 255, component: 190 }, Address { system: 1, component: 1 });
    let mut buffer = [0; FRAME_MAX];
    let frame = Encoder::new(station).send(&Uplink::Heartbeat, &mut buffer);
    println!("a heartbeat: {frame:02x?}");

    let mut stream = b"noise".to_vec();
    stream.extend_from_slice(frame);
    let mut decoder = Decoder::<Uplink>::new(vehicle);
    // Pieces of any size, as a port delivers them.
    for piece in stream.chunks(7) {
        decoder.feed(piece, |from, message| println!("from {from:?}: {message:?}"));
    }
    println!("{:?}", decoder.counters());
    assert_eq!(decoder.counters().received, 1);
}
