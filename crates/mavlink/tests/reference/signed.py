"""Writes frames signed by pymavlink, MAVLink's reference implementation, one a line: name, key, time, bytes.

    python3 -m venv venv && venv/bin/pip install pymavlink
    venv/bin/python crates/mavlink/tests/reference/signed.py >crates/mavlink/tests/reference/signed.txt
"""

from pymavlink.dialects.v20 import common as m


def show(name, key, link_id, timestamp, message):
    link = m.MAVLink(None, srcSystem=255, srcComponent=190)
    link.signing.secret_key = key
    link.signing.link_id = link_id
    link.signing.timestamp = timestamp
    link.signing.sign_outgoing = True
    print(name, key.hex(), timestamp, message.pack(link).hex())


plain, ramp = bytes([42]) * 32, bytes(range(32))
show("HEARTBEAT", plain, 0, 1, m.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
show("SET_MODE", ramp, 7, 0x123456789ABC, m.MAVLink_set_mode_message(1, 1, 0x03040000))
show("SETUP_SIGNING", ramp, 255, 2**48 - 1, m.MAVLink_setup_signing_message(1, 1, plain, 0x0102030405))
# Longer than two blocks of the hash.
show("<STATUSTEXT", ramp, 0, 35_000_000_000_000, m.MAVLink_statustext_message(4, b"x" * 50))
show("<GPS_RAW_INT", plain, 0, 35_000_000_000_001, m.MAVLink_gps_raw_int_message(
    9, 3, 473977420, 85455940, 488000, 65535, 65535, 123, 4567, 12, 0, 500, 800, 0, 0, 0))
