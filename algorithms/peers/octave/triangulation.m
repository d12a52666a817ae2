function t = triangulation(F, V)
  t = struct('F', F, 'freeBoundary', free_edges(F));
end
