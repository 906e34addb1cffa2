// Words in the reader's language: every element with data-word shows one, data-label gives one to screen readers.
const LANGUAGES = ["en", "de"];
// Gaps that hold a name which pages have words for.
const KNOWN = { role: "role", side: "side", begun: "side" };
let words = {};
let fallback = {};
export let language = "en";

function preferred() {
  const kept = localStorage.getItem("language");
  const wanted = kept ?? navigator.language.slice(0, 2);
  return LANGUAGES.includes(wanted) ? wanted : "en";
}

async function read(name) {
  const response = await fetch(`/files/words/${name}.json`);
  return response.json();
}

export async function loadWords() {
  language = preferred();
  [fallback, words] = await Promise.all([read("en"), read(language)]);
  document.documentElement.lang = language;
  translate(document);
  for (const button of document.querySelectorAll("[data-language]")) {
    button.setAttribute("aria-pressed", String(button.dataset.language === language));
    button.onclick = async () => {
      localStorage.setItem("language", button.dataset.language);
      await loadWords();
      dispatchEvent(new Event("languagechange"));
    };
  }
}

// A word by its name; {x} in it is replaced by values.x. Without one, what the server wrote is better than nothing.
export function say(name, values = {}, otherwise = name) {
  const text = words[name] ?? fallback[name] ?? otherwise;
  return text.replace(/\{(\w+)\}/g, (_, key) => values[key] ?? "");
}

// A sentence of the server, by its code. English is the server's own; what has no code in any language stays as it is.
export function sentence(spoken) {
  if (!spoken) return "";
  const gaps = Object.entries(spoken.gaps).map(([name, gap]) => [name, own(name, gap)]);
  return say(`said.${spoken.code}`, Object.fromEntries(gaps), spoken.text);
}

function own(name, gap) {
  const family = KNOWN[name];
  return family ? say(`${family}.${gap.text}`, {}, gap.text) : sentence(gap);
}

// The name of a joint or a parameter; in a machine for both arms it begins with its side.
export function nameOf(family, name) {
  const [, side, own] = /^(?:(right|left)_)?(.*)$/.exec(name);
  const what = say(`${family}.${own}`, {}, own.replaceAll("_", " "));
  return side ? say(`of.${side}`, { what }) : what;
}

export function translate(root) {
  for (const element of root.querySelectorAll("[data-word]")) element.textContent = say(element.dataset.word);
  for (const element of root.querySelectorAll("[data-label]")) {
    element.setAttribute("aria-label", say(element.dataset.label));
  }
}

export function number(value, digits = 0) {
  if (value === null || value === undefined) return "–";
  return value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}
