// The module that livebass/web/words.py makes: words in names, encodings, and sentences.
export const WORDS: Record<string, any>;
