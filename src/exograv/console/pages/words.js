// Texts in the reader's language: each element with data-word shows one; data-label gives one to screen readers.
const LANGUAGES = ["en", "de"];
// Placeholders whose value is a name that has a text of its own.
const KNOWN = { joint: "joint", role: "role", side: "side", begun: "side" };
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

// Text by its name, with {x} replaced by values.x. Without such a text, `otherwise` is shown.
export function say(name, values = {}, otherwise = name) {
  const text = words[name] ?? fallback[name] ?? otherwise;
  return text.replace(/\{(\w+)\}/g, (_, key) => values[key] ?? "");
}

// Sentence of the server by its code. English text comes from the server; a text without a code is shown unchanged.
export function sentence(spoken) {
  if (!spoken) return "";
  const gaps = Object.entries(spoken.gaps).map(([name, gap]) => [name, own(name, gap)]);
  // English text comes with the machine's own names of joints.
  const named = (text, [name, gap]) => (KNOWN[name] === "joint" ? text.replaceAll(gap.text, own(name, gap)) : text);
  const english = Object.entries(spoken.gaps).reduce(named, spoken.text);
  return say(`said.${spoken.code}`, Object.fromEntries(gaps), english);
}

function own(name, gap) {
  const family = KNOWN[name];
  if (family === "joint") return nameOf(family, gap.text);
  return family ? say(`${family}.${gap.text}`, {}, gap.text) : sentence(gap);
}

// Name of a joint or a parameter. In a machine for both arms it begins with the side.
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
