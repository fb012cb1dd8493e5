"use strict";
// Shows the cards that have every word of the search, and the sections that have such a card.
const search = document.getElementById("search"), found = document.getElementById("found");
const cards = [...document.querySelectorAll("article")], sections = [...document.querySelectorAll("section")];
function choose() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const card of cards) {
    card.hidden = !words.every((w) => card.dataset.words.includes(w));
    shown += !card.hidden;
  }
  for (const section of sections) section.hidden = !section.querySelector("article:not([hidden])");
  found.textContent = words.length ? `${shown} of ${cards.length}` : "";
}
search.addEventListener("input", choose);
choose();
