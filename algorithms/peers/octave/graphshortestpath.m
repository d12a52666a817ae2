function [d, path, before] = graphshortestpath(G, s, t)
  n = rows(G); D = inf(n, 1); before = zeros(n, 1); D(s) = 0; done = false(n, 1);
  while ~done(t)
    D_open = D; D_open(done) = inf; at = min(D_open);
    if isinf(at), break; end
    now = find(D_open == at); done(now) = true;
    [j, i, w] = find(G(:, now));
    i = now(i); new = at + w;
    better = new < D(j);
    j = j(better); i = i(better); new = new(better);
    for k = 1:numel(j)
      if new(k) < D(j(k)), D(j(k)) = new(k); before(j(k)) = i(k); end
    end
  end
  path = t; while path(1) ~= s, path = [before(path(1)), path]; end
  d = D(t);
end
