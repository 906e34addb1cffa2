// Words in the reader's language: every element with data-word shows one, data-label gives one to screen readers.
const LANGUAGES = ["en", "de"];
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
