// Keeps a page current: progress as it is told, and the parts marked `data-live` anew when a job or folder has changed.
"use strict";

const REST = 700; // milliseconds in which changes are gathered
let waiting = false;
let asked = false;
let isBehind = false; // a part was left as it was, since someone stood in it

function show({ job, doing, percent }) {
  const place = document.querySelector(`[data-progress="${Number(job)}"]`);
  if (!place) return;
  place.querySelector("progress").value = percent;
  place.querySelector("span").textContent = percent > 0 ? `${doing}, ${percent} %` : doing;
}

async function renew() {
  if (waiting) {
    asked = true;
    return;
  }
  waiting = true;
  asked = false;
  try {
    await new Promise((done) => setTimeout(done, REST));
    const answer = await fetch(location.href, { headers: { Accept: "text/html" } });
    if (answer.ok && !answer.redirected) {
      const page = new DOMParser().parseFromString(await answer.text(), "text/html");
      for (const part of document.querySelectorAll("[data-live]")) {
        const fresh = page.getElementById(part.id);
        // Whoever is about to press a button in it is not disturbed.
        const isBusy = part.contains(document.activeElement);
        const isLeft = part.dataset.live === "once" && part.children.length > 0;
        if (fresh && !isLeft && fresh.innerHTML !== part.innerHTML) {
          if (isBusy) isBehind = true;
          else part.replaceChildren(...fresh.childNodes);
        }
      }
      document.dispatchEvent(new Event("renewed"));
    }
  } catch {
    // The daemon is not there for now; the stream tells when it is back.
  }
  waiting = false;
  if (asked) renew();
}

if (document.querySelector("[data-live]")) {
  const own = location.pathname.match(/^\/jobs\/(\d+)$/);
  const events = new EventSource("/v1/events");
  // What happened between the making of this page and the begin of the stream is in no event.
  events.addEventListener("open", renew);
  document.addEventListener("focusout", () => {
    if (isBehind) renew();
    isBehind = false;
  });
  events.addEventListener("progress", (event) => show(JSON.parse(event.data)));
  events.addEventListener("job", (event) => {
    if (!own || String(JSON.parse(event.data).job) === own[1]) renew();
  });
  for (const kind of ["folder", "forgotten", "lost"]) events.addEventListener(kind, renew);
}
