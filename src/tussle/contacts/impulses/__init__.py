"""Impulses at contacts."""
