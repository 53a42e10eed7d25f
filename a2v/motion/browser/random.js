// numpy's `default_rng(seed).standard_normal(size, dtype=float32)`, so that a seed means here what it means in Python: SeedSequence, PCG64
// (XSL-RR, O'Neill 2014) and the ziggurat of 256 layers (Marsaglia and Tsang 2000).
"use strict";
const normalNoise = (() => {
  const times = Math.imul, low = (1n << 64n) - 1n, whole = (1n << 128n) - 1n;

  // 128 bits of state and of increment, of a seed below 2^53
  function spread(seed) {
    const entropy = [seed >>> 0, Math.floor(seed / 2 ** 32), 0, 0];
    let by = 0x43b0d7e5;
    const hash = value => {
      value ^= by;
      by = times(by, 0x931e8875);
      value = times(value, by);
      return value ^ value >>> 16;
    };
    const mix = (x, y) => { const mixed = times(0xca01f9dd, x) - times(0x4973f715, y) | 0; return mixed ^ mixed >>> 16; };
    const pool = entropy.map(hash);
    for (let from = 0; from < 4; from++) for (let to = 0; to < 4; to++) if (from !== to) pool[to] = mix(pool[to], hash(pool[from]));
    by = 0x8b51f9dd;
    const words = [...pool, ...pool].map(value => {
      value ^= by;
      by = times(by, 0x58f38ded);
      value = times(value, by);
      return BigInt((value ^ value >>> 16) >>> 0);
    });
    const [a, b, c, d] = [0, 2, 4, 6].map(at => words[at] | words[at + 1] << 32n);
    return [a << 64n | b, c << 64n | d];
  }

  function words32(seed) {
    const [start, stream] = spread(seed), increment = (stream << 1n | 1n) & whole;
    const step = state => state * 0x2360ed051fc65da44385df649fccf645n + increment & whole;
    let state = step(step(0n) + start & whole), kept = null;
    return () => {
      if (kept !== null) { const word = kept; kept = null; return word; }
      state = step(state);
      const value = state >> 64n ^ state & low, turn = state >> 122n;
      const turned = (value >> turn | value << (64n - turn)) & low;
      kept = Number(turned >> 32n);
      return Number(turned & 0xffffffffn);
    };
  }

  const END = 3.6541528853610088, AREA = 0.004928673233974658;  // where the last layer begins, and the area of each
  const inside = new Uint32Array(256), width = new Float32Array(256), height = new Float32Array(256);
  const bell = x => Math.exp(-0.5 * x * x);
  for (let layer = 255, x = END, outer = END; layer > 0; layer--) {
    width[layer] = x / 2 ** 23;
    height[layer] = bell(x);
    outer = x;
    x = layer > 1 ? Math.sqrt(-2 * Math.log(AREA / x + bell(x))) : 0;
    inside[layer] = x / outer * 2 ** 23;
  }
  const base = AREA / bell(END);
  inside[0] = END / base * 2 ** 23;
  width[0] = base / 2 ** 23;
  height[0] = 1;

  // a function that returns the requested number of the seed's random numbers, call after call
  return seed => {
    const word = words32(seed), share = () => (word() >>> 8) / 2 ** 24;
    const one = () => {
      for (;;) {
        const bits = word(), layer = bits & 255, sign = bits >>> 8 & 1 ? -1 : 1, place = bits >>> 9;
        const x = Math.fround(place * width[layer]);
        if (place < inside[layer]) return sign * x;
        if (layer === 0) {
          for (;;) {
            const beyond = -Math.log1p(-share()) / END, over = -Math.log1p(-share());
            if (2 * over > beyond * beyond) return (place >>> 8 & 1 ? -1 : 1) * (END + beyond);
          }
        }
        if ((height[layer - 1] - height[layer]) * share() + height[layer] < bell(x)) return sign * x;
      }
    };
    return size => Float32Array.from({ length: size }, one);
  };
})();
