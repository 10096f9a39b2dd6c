# SPDX-License-Identifier: GPL-2.0-or-later
"""Names that cannot be moved against the simulator here, why, and the test that moves them."""

ELSEWHERE = {
    # moved against images of the daemon. The guard needs root; the kernel keeps foreign
    # packets from a connected socket, and sends what it is given on a loopback; an answer
    # is late only if the daemon looks for it late; 64 one-shots are taken too quickly,
    # and a buffer is emptied too quickly
    "every_out_pin.c": (r"daemon\.guard", r"packets\.(?:stale|wrong-source|send-failed)",
                        r"one-shot-full", r"threading\.preparing"),
    # the delay of the buffer lasts milliseconds
    "every_in_pin.c": (r"motion-type",),
    # a moment without a processor stops a motor, as it must
    "servos.c": (r"servo\.\d\d\..*",),
    # a device that is restarted ends every session here
    "encoder_restart.c": (r"encoder-keep-count", r"encoder\.\d\d\.count-lost"),
    "live_machine.py": (r"position-lost", r"unhome", r"encoder-count-lost",
                        r"joint\.\d\d\.(?:position-lost|motion-homed)"),
    # a buffer that runs dry as it likes
    "position.c": (r"engine\.dry-loses-position",),
    # the thread reads and writes
    "live_motion.py": (r"read-missing",),
    # the lock needs another period of the daemon and of the thread than they have here
    "live_phase.py": (r"phase-locked", r"phase-error-us"),
    # a state of the engine that lasts two cycles, the way of a value through HAL, and the
    # loop of the userspace component
    "legacy_every_pin.c": (r"PEv2\.digin\.Probed\.in",
                           r"rtc\.(?:hal-latency|loop-frequ-demand|sec-ret)"),
}
