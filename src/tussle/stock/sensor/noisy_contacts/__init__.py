"""NoisyContacts: what an entity measures of the others, with noise."""

from tussle.stock.sensor.noisy_contacts.plugin import NoisyContacts

__all__ = ["NoisyContacts"]
