"""NoisyContacts: noisy measurements of other entities."""

from tussle.plugins.stock.sensor.noisy_contacts.plugin import NoisyContacts

__all__ = ["NoisyContacts"]
