function e = freeBoundary(t)
  F = t.F; n = max(F(:));
  H = sparse(F, F(:, [2 3 1]), 1, n, n);
  [from, to] = find(H > H');
  next = zeros(n, 1); next(from) = to;
  loop = min(from);
  while next(loop(end)) ~= loop(1), loop(end + 1, 1) = next(loop(end)); end
  e = [loop, loop([2:end 1])];
end
