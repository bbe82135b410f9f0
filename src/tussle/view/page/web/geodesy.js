// Latitude and longitude of places of the world, as in geodesy.py.
/** @import { Vector } from './types' */

import { add, norm, scaled } from './geometry.js';

/** WGS84: semi-major axis [m] and flattening. */
const SEMI_MAJOR = 6378137;
const FLATTENING = 1 / 298.257223563;
const ECCENTRICITY_SQUARED = FLATTENING * (2 - FLATTENING);
const BOWRING_STEPS = 4;
/** Distance from the origin beyond which the plane of the world says nothing of the Earth [m]. */
const MAX_FROM_ORIGIN = 1e6;
const DEGREE = Math.PI / 180;

/**
 * Latitude and longitude [degrees] and height above the ellipsoid [m] of a place; null far from the origin.
 * @param {Vector} origin the same of the origin @param {Vector} place
 */
export function geodeticOf(origin, place) {
  if (!(norm(place) < MAX_FROM_ORIGIN)) return null;
  const [sinLat, cosLat, sinLon, cosLon] = [origin[0], origin[1]].flatMap((angle) => [Math.sin(angle * DEGREE), Math.cos(angle * DEGREE)]);
  const radius = SEMI_MAJOR / Math.sqrt(1 - ECCENTRICITY_SQUARED * sinLat * sinLat);
  const axes = [[-sinLon, cosLon, 0], [-sinLat * cosLon, -sinLat * sinLon, cosLat], [cosLat * cosLon, cosLat * sinLon, sinLat]];
  const middle = [0, 0, -ECCENTRICITY_SQUARED * radius * sinLat];
  const [x, y, z] = add(add(middle, scaled(axes[2], radius + origin[2] + place[2])), add(scaled(axes[0], place[0]), scaled(axes[1], place[1])));
  const across = Math.hypot(x, y);
  // Bowring 1985; each step gains far more digits than one turn of a browser's sine loses.
  let [rise, run] = [z, across * (1 - ECCENTRICITY_SQUARED)];
  for (let i = 0; i < BOWRING_STEPS; i++) {
    const parametric = Math.atan2((1 - FLATTENING) * rise, run);
    rise = z + (ECCENTRICITY_SQUARED / (1 - ECCENTRICITY_SQUARED)) * SEMI_MAJOR * (1 - FLATTENING) * Math.sin(parametric) ** 3;
    run = across - ECCENTRICITY_SQUARED * SEMI_MAJOR * Math.cos(parametric) ** 3;
  }
  const latitude = Math.atan2(rise, run);
  const height = across * Math.cos(latitude) + z * Math.sin(latitude) - SEMI_MAJOR * Math.sqrt(1 - ECCENTRICITY_SQUARED * Math.sin(latitude) ** 2);
  return [latitude / DEGREE, Math.atan2(y, x) / DEGREE, height];
}

/** An angle in degrees to a tenth of a metre on the ground, with a letter for its side. @param {number} angle @param {string} sides such as NS */
function sided(angle, sides) {
  return `${Math.abs(angle).toFixed(6)}° ${sides[angle < 0 ? 1 : 0]}`;
}

/** @param {Vector} geodetic @returns {[latitude: string, longitude: string]} */
export const sidesOf = (geodetic) => [sided(geodetic[0], 'NS'), sided(geodetic[1], 'EW')];
