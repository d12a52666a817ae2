function c = vertexAttachments(t, varargin)
  m = rows(t.F); [~, order] = sort(t.F(:)); 
  face = mod(order - 1, m) + 1;
  c = mat2cell(face.', 1, accumarray(t.F(:), 1).').';
end
