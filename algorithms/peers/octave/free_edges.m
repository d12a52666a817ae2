function e = free_edges(F)
  n = max(F(:));
  H = sparse(F, F(:, [2 3 1]), 1, n, n);
  [from, to] = find(H > H');
  e = [from, to];
end
