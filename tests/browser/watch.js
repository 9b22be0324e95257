new MutationObserver(() => console.info(`view ${canvas.dataset.view}`)).observe(canvas,
  { attributeFilter: ["data-view"] });
