// Draws every figure.
(function () {
  counted();
  const root = document.documentElement, drawn = [], apply = themed(document.getElementById("theme"));

  const data = JSON.parse(document.getElementById("data").textContent);
  const add = (Kind, figure, of, options) => { const made = new Kind(figure, of, options); drawn.push(made); return made; };
  for (const figure of document.querySelectorAll("figure[data-plot]")) add(Plot, figure, data[figure.dataset.plot]);
  for (const figure of document.querySelectorAll("figure[data-rows]")) add(Rows, figure, data[figure.dataset.rows]);
  for (const figure of document.querySelectorAll("figure[data-view]")) add(View, figure, data[figure.dataset.view]);
  for (const place of document.querySelectorAll("[data-multiples]")) multiples(place, data[place.dataset.multiples]);

  // Small charts with a common scale; the selected one is also shown large.
  function multiples(place, items) {
    const figures = [...place.querySelectorAll(".large figure")], small = [...place.querySelectorAll(".small figure")];
    let shown = [];
    const show = k => {
      shown.forEach(plot => drawn.splice(drawn.indexOf(plot), 1));
      small.forEach((figure, j) => { figure.classList.toggle("on", j === k); figure.setAttribute("aria-pressed", String(j === k)); });
      shown = figures.map((figure, j) => {
        const of = data[items[k].large[j]], caption = figure.querySelector("figcaption");
        figure.replaceChildren(caption);
        caption.textContent = j === 0 || of.bare ? of.title : "";
        delete figure.dataset.points;
        return add(Plot, figure, of);
      });
    };
    small.forEach((figure, k) => {
      add(Plot, figure, data[items[k].small], { small: true, range: items[k].range });
      const open = () => show(k);
      figure.addEventListener("click", open);
      figure.addEventListener("keydown", e => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); open(); } });
    });
    show(Number(place.dataset.selected) || 0);
  }

  const redraw = () => { for (const one of drawn) { delete one.figure.dataset.points; one.draw(); } };

  // Segmented choices: each selects a value of a key; a pane is visible if all its keys are selected.
  for (const box of document.querySelectorAll("[data-choices]")) {
    const groups = [...box.querySelectorAll(".choice[data-axis]")];
    const panes = [...box.querySelectorAll(".pane")].filter(pane => pane.closest("[data-choices]") === box);
    const set = () => {
      const wanted = groups.map(group => group.querySelector(".on").dataset.value);
      const exact = panes.find(pane => pane.dataset.value === wanted.join(" "));
      // If a combination was not run, use the first one of the same group.
      const pane = exact || panes.find(pane => pane.dataset.value.split(" ")[0] === wanted[0]);
      panes.forEach(one => { one.hidden = one !== pane; });
      pane.dataset.value.split(" ").forEach((value, k) => [...groups[k].children].forEach(button => {
        button.classList.toggle("on", button.dataset.value === value);
        button.setAttribute("aria-pressed", String(button.dataset.value === value));
      }));
      redraw();
    };
    for (const group of groups) for (const button of group.children) button.addEventListener("click", () => {
      [...group.children].forEach(one => one.classList.toggle("on", one === button));
      set();
    });
  }

  for (const button of document.querySelectorAll("[data-copy]")) button.addEventListener("click", () => {
    navigator.clipboard.writeText(button.dataset.copy).then(() => { button.textContent = "Copied"; }, () => {});
  });
  for (const button of document.querySelectorAll("[data-toggle]")) button.addEventListener("click", () => {
    const target = document.getElementById(button.dataset.toggle);
    target.hidden = !target.hidden;
  });

  for (const table of document.querySelectorAll("table")) {
    const name = table.caption.textContent.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
    const button = html("button", table.caption, "CSV");
    table.caption.insertBefore(document.createTextNode(" "), button);
    button.addEventListener("click", () => download(name + ".csv", [...table.rows].map(row => [...row.cells].map(cell => quoted(cell.textContent)).join(",")).join("\n") + "\n"));
  }

  // Mark the current section in the header.
  const links = [...document.querySelectorAll(".top nav a")];
  const here = () => {
    let last = links[0];
    for (const link of links) {
      const target = document.querySelector(link.getAttribute("href"));
      if (target && target.getBoundingClientRect().top < 120) last = link;
    }
    links.forEach(link => link.classList.toggle("here", link === last));
  };
  window.addEventListener("scroll", here, { passive: true });
  here();
  // Horizontal overflow of the page, px.
  root.dataset.overflow = String(root.scrollWidth - root.clientWidth);

  let width = window.innerWidth;
  window.addEventListener("resize", () => { if (window.innerWidth !== width) { width = window.innerWidth; redraw(); } });
  // Print on white, with figures drawn at the paper's width.
  window.addEventListener("beforeprint", () => { root.classList.remove("dark"); root.classList.add("print"); redraw(); });
  window.addEventListener("afterprint", () => { root.classList.remove("print"); apply(); redraw(); });
})();
