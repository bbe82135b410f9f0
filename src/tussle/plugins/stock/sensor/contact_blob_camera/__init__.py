"""ContactBlobCamera: boxes around entities in an image."""

from tussle.plugins.stock.sensor.contact_blob_camera.plugin import ContactBlobCamera, ContactBlobCameraNoNoise

__all__ = ["ContactBlobCamera", "ContactBlobCameraNoNoise"]
