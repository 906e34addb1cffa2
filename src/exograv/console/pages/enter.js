// Login: exchange the link's token for a cookie. The token leaves the address at once and reaches no history or log.
import { loadWords, say } from "./words.js";

async function enter() {
  await loadWords();
  const said = document.getElementById("said");
  const token = location.hash.slice(1);
  history.replaceState(null, "", location.pathname);
  if (!token) {
    said.textContent = say("enter.no_token");
    return;
  }
  said.textContent = say("enter.entering");
  try {
    const response = await fetch("/enter", {
      method: "POST",
      headers: { "X-Exograv": "1", "Content-Type": "application/json" },
      body: JSON.stringify({ token }),
    });
    const answer = await response.json();
    if (response.ok) {
      location.replace(`/${answer.role}/`);
    } else {
      said.textContent = say(response.status === 429 ? "enter.locked" : "enter.refused");
    }
  } catch {
    said.textContent = say("enter.no_server");
  }
}

enter();
