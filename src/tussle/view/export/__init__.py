"""Exports of recorded runs: HTML page, films and pictures, MCAP, tables."""
