"""The world around the entities: scene, shapes, rays and contacts."""
