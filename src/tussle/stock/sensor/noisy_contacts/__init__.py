"""NoisyContacts: noisy measurements of other entities."""

from tussle.stock.sensor.noisy_contacts.plugin import NoisyContacts

__all__ = ["NoisyContacts"]
