/* Search: guides come first, then examples, then pages of functions, whose names repeat a word. */
var Scorer = {
  score: ([page, , , , score]) => (
    /^((api|_modules)\/|(api|cli|modules)$)/.test(page) ? score - 20
      : page.startsWith("gallery/") ? score - 8 : score
  ),
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
