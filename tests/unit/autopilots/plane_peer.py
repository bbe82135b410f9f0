"""Flies the FixedWing6DOFRascal of tussle in the place of ArduPilot, with the packets of its model scrimmage.

python plane_peer.py 5003 5002 120      # climb to an altitude of 120 m and hold it and the heading
"""

import math
import socket
import struct
import sys


def pulse(x):
    return round(1500 + 500 * max(-1.0, min(1.0, x)))


def main(port, to_port, goal):
    """Fly until killed."""
    own = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    own.bind(("127.0.0.1", port))
    print("ready", flush=True)
    heading = None
    while True:
        _, _, _, altitude, yaw, *values = struct.unpack("<Q17d", own.recv(4096))
        down, (p, q, r), (roll, pitch, _) = values[2], values[6:9], values[9:12]
        heading = yaw if heading is None else heading
        climb = max(-0.15, min(0.15, 0.02 * (goal - altitude) + 0.03 * down))
        bank = max(-0.4, min(0.4, math.remainder(heading - yaw, 2.0 * math.pi)))
        aileron, elevator = 0.8 * (bank - roll) - 0.2 * p, 1.5 * (climb - 0.05 - pitch) - 0.3 * q
        # Outputs of a plane: aileron, elevator, throttle, rudder. Long pulses: right wing down, nose up, full, nose to the right.
        outputs = [pulse(aileron), pulse(elevator), 1700, pulse(0.2 * (0.0 - r)), *[0] * 12]
        own.sendto(struct.pack("<16H", *outputs), ("127.0.0.1", to_port))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
