"""Constants shared by the lane functions and their code generators."""

LANES = 8
"""Agents per block. Eight doubles fill one AVX-512 register; on narrower CPUs eight still amortise loading the candidate."""

RSQRT_MAGIC = 0x5FE6EB50C7B537A9
