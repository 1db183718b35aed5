"""Policies trained elsewhere, in the network of fixed size that flies: two layers of 32 tanh neurons and a linear output.

A policy follows a reference, knows one obstacle at a time, and is asked 50 times a second. All numbers are of order one.

========= ================================================================ =============
observed  what                                                             scale
========= ================================================================ =============
0 to 2    reference minus position, NED, limited to 10 m                   2 m
3 to 5    reference velocity minus velocity, NED, limited to 25 m/s        5 m/s
6 to 8    reference velocity, NED, limited to 25 m/s                       5 m/s
9 to 17   body axes in NED: forward, right, down                           1
18 to 20  body rates, limited to 25 rad/s                                  5 rad/s
21        1 where an obstacle is known, else 0, and the next two with it   1
22, 23    from the vehicle to its axis, north and east                     its range
24        wing command that holds                                          1
========= ================================================================ =============

The action is roll and pitch as shares of the largest tilt, thrust in weights above hover, wings from -1 folded to 1
spread; each counts limited to [-1, 1].
"""

from squirrel._squirrel import Policy

__all__ = ["Policy"]
