// Search in what is ordered.

/** The last of n numbers from 0 for which a condition holds that holds for all before it; -1 without one. @param {number} n @param {(i: number) => boolean} holds */
export function lastWhere(n, holds) {
  let [low, high] = [-1, n];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (holds(middle)) low = middle;
    else high = middle;
  }
  return low;
}

/** Number of the last time that is not after a time; -1 without one. @param {ArrayLike<number>} times @param {number} t */
export function lastNotAfter(times, t, slack = 1e-9) {
  return lastWhere(times.length, (i) => times[i] <= t + slack);
}
