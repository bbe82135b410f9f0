"""Numbers that the functions on lanes and their machine code share."""

LANES = 8
"""Agents per block. Eight doubles are one AVX-512 register; on narrower CPUs eight still amortise the candidate's loads."""

RSQRT_MAGIC = 0x5FE6EB50C7B537A9
