"""Which of the latest messages of a kind belongs to a joint state. No ROS here."""

import collections

KEPT = 256  # messages: 0.5 s of an IMU at 500 Hz


def stamp_of(message):
    """The stamp of its header [s]; None of a message that has no header, or whose stamp is 0."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return None
    return (stamp.to_sec() if hasattr(stamp, "to_sec") else stamp.sec + 1e-9 * stamp.nanosec) or None


class History:
    """What came, with its stamp or None, and the time at which it arrived [s].

    Where messages and joint state have stamps, the nearest by stamp belongs to the joint state, and its age is the
    difference of stamps; else the newest, and the difference of arrivals. None does that is older than max_age [s].
    """

    def __init__(self, max_age):
        self.max_age, self._kept = max_age, collections.deque(maxlen=KEPT)

    def add(self, item, stamp, arrived):
        last = self._kept[-1][1] if self._kept else None
        if stamp is None or last is None or stamp < last:  # a bag that starts again: time jumps back
            self._kept.clear()
        self._kept.append((item, stamp, arrived))

    def at(self, stamp, arrived):
        """The item that belongs to a joint state; None: there is none."""
        if not self._kept:
            return None
        item, stamped, came = self._kept[-1]
        age = abs(arrived - came)
        if stamp is not None and stamped is not None:
            item, stamped, _ = min(self._kept, key=lambda kept: abs(kept[1] - stamp))
            age = abs(stamped - stamp)
        return item if age <= self.max_age else None
