% The harmonic map to the unit disk with the boundary by arc length, in Octave or MATLAB:
%
%     cembench map face.obj --command tutte.m
%
function uv = tutte(V, F)
  n = size(V, 1);
  H = sparse(F, F(:, [2 3 1]), 1, n, n);      % the directed edges
  [from, to] = find(H > H');                 % those without a twin: the boundary
  next = zeros(n, 1);  next(from) = to;
  loop = from(1);
  while next(loop(end)) ~= loop(1), loop(end + 1) = next(loop(end)); end
  lengths = sqrt(sum((V(loop([2:end 1]), :) - V(loop, :)) .^ 2, 2));
  angle = 2 * pi * [0; cumsum(lengths(1:end-1))] / sum(lengths);
  L = sparse(n, n);
  for k = 1:3                                 % cotangents
    i = F(:, k);  j = F(:, mod(k, 3) + 1);  h = F(:, mod(k + 1, 3) + 1);
    a = V(i, :) - V(h, :);  b = V(j, :) - V(h, :);
    w = 0.5 * sum(a .* b, 2) ./ sqrt(sum(cross(a, b, 2) .^ 2, 2));
    L = L + sparse([i; j; i; j], [j; i; i; j], [-w; -w; w; w], n, n);
  end
  z = zeros(n, 1);  z(loop) = exp(1i * angle);
  inside = setdiff(1:n, loop);
  z(inside) = -L(inside, inside) \ (L(inside, loop) * z(loop));
  uv = [real(z) imag(z)];
end
