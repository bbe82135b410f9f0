"""What a run leaves behind."""

from tussle.record.state_hash import hash_columns

__all__ = ["hash_columns"]
