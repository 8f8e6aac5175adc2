"""First inputs of the targets of containers, as foreign writers make them, in `target/fuzz` (pip install scipy h5py nptdms)."""

import os

import h5py, numpy as np, scipy.io, gzip
from nptdms import ChannelObject, TdmsWriter, RootObject, GroupObject

def folder(target):
    os.makedirs(f"target/fuzz/{target}", exist_ok=True)
    return f"target/fuzz/{target}/"


N=104
t=np.arange(N)*1e-3; u=np.where(np.arange(N)%52<26, np.arange(N)%52, 52-np.arange(N)%52)*3.0; y=np.round(u*0.25+np.sin(np.arange(N))*0.01,3)
cols={"time_s":t,"drive_V":u,"displacement_um":y}
m=folder("mat")
scipy.io.savemat(m+"small.mat",cols)
scipy.io.savemat(m+"z.mat",cols,do_compression=True)
scipy.io.savemat(m+"struct.mat",{"scan":{"X":{"Data":t,"Name":"time"},"Y":np.array([(u,"drive_V"),(y,"displacement_um")],dtype=[("Data",object),("Name",object)])}})
scipy.io.savemat(m+"types.mat",{"a":t.astype("f4"),"b":u.astype("i2"),"c":np.array([[1+2j,2]]),"d":"text","e":np.array(["a","b"],dtype=object),"drive_V":u.astype("u1"),"f":np.eye(3)})
import scipy.sparse
scipy.io.savemat(m+"other.mat",{"s":scipy.sparse.eye(4),"l":np.array([True,False]),"matrix":np.c_[t,u,y].astype("f4")})
h=folder("hdf5")
def f(name,**k): return h5py.File(h+name,"w",**k)
with f("plain.h5") as g:
    for k,v in cols.items(): g[k]=v
with f("f4z.h5") as g:
    for k,v in cols.items(): g.create_dataset(k,data=v.astype("f4"),chunks=(32,),compression="gzip",shuffle=True,fletcher32=True)
with f("v3.h5",libver="latest") as g:
    for k,v in cols.items(): g.create_dataset("scan/"+k,data=v.astype("f4"))
with f("latest-ext.h5",libver="latest") as g:
    for k,v in cols.items(): g.create_dataset(k,data=v.astype("f4"),chunks=(16,),maxshape=(None,),compression="gzip")
with f("cyclic.h5") as g:
    a=g.create_group("a"); a["self"]=a; a["root"]=g["/"]; a["soft"]=h5py.SoftLink("/a/soft"); a["ext"]=h5py.ExternalLink("x.h5","/")
    for k,v in cols.items(): a[k]=v.astype("f4")
with f("types.h5") as g:
    g["i"]=u.astype("i2"); g["b"]=u.astype("u1"); g["bool"]=u>3; g["s"]=np.array(["a","bb"],dtype="S4"); g["v"]="text"; g["h"]=t.astype("f2")
    g["c"]=np.array([(1,2.0)],dtype=[("x","i4"),("y","f8")]); g["big"]=u.astype(">f8"); g["m"]=np.c_[t,u,y].astype("f4")
    g["ref"]=g["i"].ref; g["so"]=1; g.attrs["MATLAB_class"]=np.bytes_("double")
    g.create_dataset("scale",data=u.astype("i4"),chunks=(52,),scaleoffset=0); g.create_dataset("lzf",data=u,chunks=(52,),compression="lzf")
with f("never.h5") as g:
    g.create_dataset("huge",shape=(10**12,),dtype="f8",chunks=(1024,))
    for k,v in cols.items(): g[k]=v.astype("f4")
with h5py.File(h+"v73.mat","w",userblock_size=512) as g:
    for k,v in cols.items(): g[k]=v.astype("f4").reshape(1,-1); g[k].attrs["MATLAB_class"]=np.bytes_("single")
d=folder("tdms")
with TdmsWriter(d+"small.tdms") as w: w.write_segment([ChannelObject("g",k,v.astype("f4")) for k,v in cols.items()])
with TdmsWriter(d+"two.tdms") as w:
    for s in (slice(0,50),slice(50,None)): w.write_segment([RootObject({"a":1,"b":"x"}),GroupObject("g",{"c":2.0})]+[ChannelObject("g",k,v[s]) for k,v in cols.items()])
with TdmsWriter(d+"types.tdms") as w:
    w.write_segment([ChannelObject("g","i",u.astype("i2"),{"wf_increment":1e-3}),ChannelObject("g","s",["a","bc"]),ChannelObject("g","t",np.array(["2026-01-01"],dtype="datetime64[us]")),ChannelObject("g","f",u>3)])
p=folder("packed")
np.save(p+"m.npy",np.c_[t,u,y]); np.save(p+"f.npy",np.asfortranarray(np.c_[t,u,y].astype("f4")))
np.save(p+"r.npy",np.rec.fromarrays([t,u,y],names="time_s,drive_V,displacement_um"))
text="time_s,drive_V,displacement_um\n"+"".join(f"{a:g},{b:g},{c:g}\n" for a,b,c in zip(t,u,y))
open(p+"t.gz","wb").write(gzip.compress(text.encode(),mtime=0)); open(p+"le.csv","wb").write(text.encode("utf-16")); open(p+"be.csv","wb").write(b"\xfe\xff"+text.encode("utf-16-be"))
open(p+"two.gz","wb").write(gzip.compress(text[:800].encode(),mtime=0)+gzip.compress(text[800:].encode(),mtime=0))
open(p+"npy.gz","wb").write(gzip.compress(open(p+"f.npy","rb").read(),mtime=0))
