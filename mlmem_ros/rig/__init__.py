# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A real element behind a serial line or TCP: the protocol, its driver, and an emulated rig.

**Quantities**

- V is the displacement of the substrate's right end, 0 without strain. `position` and `velocity`
  are those of the held end for the first h set-points of a PLAY; then it is let go. The other end
  is always free.
- Displacements are in units of the rig's `length`; its `zero` is added to those of the ends, not
  to V. Velocities are per time unit.
- m is the number of `nodes`: a rig takes m set-points of V, position and velocity in a sample.
- Samples count from 0 in every conversation, and so do set-points: sample k is taken at the end of
  set-point k.
- A frame has whole ticks. A PLAY has `buffer` / 2 samples at most.

**A conversation**

1. The driver sends its HELLO: `{"protocol": 1, "ahead": 0.05}`, where `ahead` is the lead in
   seconds.
2. After every HELLO the rig forgets the last conversation, releases the ends, brings the strain
   slowly to zero, and answers with its own HELLO.
3. The driver sends set-points for `ahead` seconds. The rig plays them as soon as it has that many,
   or when the first has waited that long.
4. The rig sends samples as it takes them, a tick or more in a frame. The driver sends new
   set-points for as many.
5. When the rig runs out of set-points, it holds strain and held end, and counts. These samples get
   no number; the next SAMPLES says how many they were. The rig then waits for `ahead` seconds of
   set-points again.
6. When the driver has gone, the rig releases the ends and brings the strain slowly to zero. A rig
   on a serial line takes a second of silence while the element is strained for that, and ends with
   a FAULT.

**Lost frames.** Each side takes frames in order. It drops a frame with another number than the
one it expects, and if that number was greater, requests the expected one by AGAIN. After a silence
a driver repeats its last frame and requests the next. A rig keeps the frames of its last `buffer`
samples to send them again; on TCP it need not, and may ignore AGAIN.
"""

from .driver import Rig

__all__ = ['Rig']
