# SPDX-License-Identifier: GPL-2.0-or-later
"""A wire of our own: a veth pair with the devices at the far end, in a network
namespace of their own, so that packets go through an interface as they do with a
card, and XDP and AF_XDP have something to sit on. To be used inside
scripts/hal-isolated --network."""
import subprocess

from rig import Fault

HERE, DEVICES = "10.77.0.1", 64


def sh(*words):
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        raise Fault(f"{' '.join(words)}: {done.stderr.strip()}")


class Network:
    interface, far_interface = "pk0", "pk1"

    def __init__(self):
        # pylint: disable=consider-using-with
        self.holder = subprocess.Popen(
            ["unshare", "--net", "sh", "-c", "ip link set lo up && echo ready && exec cat"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self.holder.stdout.readline().strip() != "ready":
            raise Fault("there is no second network namespace to be had")
        namespace = str(self.holder.pid)
        self.there = ("nsenter", "--target", namespace, "--net")
        self.device = self.address(0)
        sh("ip", "link", "add", self.interface, "type", "veth", "peer", "name", self.far_interface,
           "netns", namespace)
        sh("ip", "address", "add", f"{HERE}/24", "dev", self.interface)
        sh("ip", "link", "set", self.interface, "up")
        for number in range(DEVICES):
            sh(*self.there, "ip", "address", "add", f"{self.address(number)}/24", "dev", self.far_interface)
        sh(*self.there, "ip", "link", "set", self.far_interface, "up")

    @staticmethod
    def address(number):
        """Of the device of that number, from 0."""
        return f"10.77.0.{10 + number}"

    def close(self):
        self.holder.stdin.close()
        self.holder.wait()
