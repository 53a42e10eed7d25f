// A line of text as movements of the mouth: letters become visemes, and these the shapes that the character's face has.
"use strict";
function makeSpeech(model, visemes) {
  const PAIRS = { th: "TH", sh: "CH", ch: "CH", ph: "FF", ng: "nn", qu: "kk", oo: "U", ou: "U", ee: "I", ea: "I", ai: "E", ck: "kk" };
  const LETTERS = {
    a: "aa", e: "E", i: "I", y: "I", o: "O", u: "U", w: "U", p: "PP", b: "PP", m: "PP", f: "FF", v: "FF", d: "DD", t: "DD",
    k: "kk", g: "kk", c: "kk", q: "kk", x: "kk", s: "SS", z: "SS", j: "CH", n: "nn", l: "nn", r: "RR", h: "E",
  };
  const VOWELS = new Set(["aa", "E", "I", "O", "U"]);
  const meshes = [];
  model.traverse(node => { if (node.isMesh && node.morphTargetDictionary && "jawOpen" in node.morphTargetDictionary) meshes.push(node); });
  const shapes = [...new Set(Object.values(visemes).flatMap(parts => Object.keys(parts)))];
  let line = [], begun = -1;

  /** Visemes of a text with the seconds of their middle; other scripts than Latin open and close the mouth. */
  function spelled(text) {
    const letters = text.toLowerCase().normalize("NFD").replace(/\p{M}/gu, ""), found = [];
    let at = 0.15;
    for (let i = 0; i < letters.length; i++) {
      const pair = PAIRS[letters.slice(i, i + 2)], letter = letters[i];
      if (/[.,;:!?\n]/.test(letter)) { at += 0.3; continue; }
      if (!pair && !/\p{L}/u.test(letter)) { at += 0.07; continue; }
      const viseme = pair || LETTERS[letter] || (i % 2 ? "DD" : "aa"), long = VOWELS.has(viseme) ? 0.12 : 0.075;
      if (found.length && found[found.length - 1].viseme === viseme && at - found[found.length - 1].at < 0.13) { at += 0.04; continue; }
      found.push({ viseme, at: at + long / 2 });
      at += long;
      if (pair) i++;
    }
    return { found, seconds: at + 0.2 };
  }

  return {
    able: meshes.length > 0,
    /** Begin a line at a moment in seconds; how long it takes. */
    say(text, moment) {
      const { found, seconds } = spelled(text);
      line = found;
      begun = moment;
      return seconds;
    },
    /** Shape the mouth for a moment; over what the animation has done to the face. Whether it still speaks. */
    show(moment) {
      if (begun < 0) return false;
      const time = moment - begun, strength = {}, over = !line.length || time > line[line.length - 1].at + 0.3;
      for (const { viseme, at } of line) {
        const near = Math.abs(time - at) / 0.1;
        if (near >= 1) continue;
        const share = 0.5 + 0.5 * Math.cos(Math.PI * near);
        for (const [name, value] of Object.entries(visemes[viseme])) strength[name] = Math.max(strength[name] || 0, share * value);
      }
      for (const mesh of meshes) for (const name of shapes) {
        const index = mesh.morphTargetDictionary[name];
        if (index !== undefined) mesh.morphTargetInfluences[index] = Math.min(1, strength[name] || 0);
      }
      if (over) begun = -1;
      return !over;
    },
  };
}
