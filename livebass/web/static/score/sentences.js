// Puts numbers and names into the sentences that Python has (words.js).

export const NUMBERS = [0, 1, 2, 3, 4, 5]; // of a remark or an error in the kernels' memory

// A value in a sentence: with its sign, in two hexadecimal digits, or as it is.
function shown(value, how) {
  if (how === ":02X") return value.toString(16).toUpperCase().padStart(2, "0");
  return how === ":+" && value >= 0 ? `+${value}` : String(value);
}

// The sentence `of` a code with its values; of two sentences the first is for one.
export const sentence = (of, values) => (typeof of === "string" ? of : of[Number(values[0] > 1)])
  .replace(/\{(\d)(:02X|:\+)?\}/g, (_, k, how) => shown(values[k], how));
